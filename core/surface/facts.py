"""What the report tells of meshes."""

from dataclasses import replace

from ..parallel import in_order
from ..progress import Progress
from .extract import Surfaces
from .meshing.pieces import piece_count
from .meshing.quality import quad_quality, triangle_quality


def _edge_facts(mesh):
    mesh = replace(mesh)  # its edges would stay in memory with it
    return {"borders": mesh.border_loops(), "nonmanifold_edges": int((mesh.edges.count > 2).sum())}


_FACTS = (  # what takes longest first, as they are found side by side
    triangle_quality,
    _edge_facts,
    lambda mesh: {"pieces": piece_count(mesh)},
    quad_quality,
)


def mesh_facts(surfaces: Surfaces, progress=None) -> dict[str, dict]:
    """What the report tells of each mesh, by kind."""
    facts = {}
    for (kind, mesh), part in Progress.of(progress).turns(surfaces.meshes.items()):
        facts[kind] = {"vertices": len(mesh.vertices), "faces": len(mesh.faces)}
        facts[kind] |= {"pieces_dropped": surfaces.dropped[kind]}
        for _, found in in_order(lambda fact, mesh=mesh: fact(mesh), part.each(_FACTS)):
            facts[kind] |= found
    return facts
