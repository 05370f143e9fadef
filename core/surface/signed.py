"""Signed distance of closed shapes.

The paper's appendix orients the samples and integrates a second time with oriented normals. Here the distances exist
already and only their sides are missing (see :mod:`.signs.sides`).
"""

import numpy as np

from ..errors import InputError
from ..field.blocks import Blocks, each
from ..field.grid import Grid
from ..field.local_surface import LocalSurface
from ..progress import Progress
from ..settings import options
from .mesh import Mesh
from .meshing.evening import evened
from .meshing.finishing import finished
from .meshing.pieces import pieces_with_samples
from .meshing.settling import settled
from .meshing.triangles import mesh_of
from .signs.sides import Sides
from .signs.thin_parts import find_thin_parts
from .signs.zero_set import zero_set

_CLAMP = 3.0  # cells; farther values do not matter for the mesh
_SMOOTHING = 20  # rounds, over gaps


def signed_distance(values, sides: Sides, surface: LocalSurface, place=np.asarray) -> np.ndarray | Blocks:
    """The distances `values` (nx,ny,nz) float32 or Blocks with the sign of their side: negative inside.

    place : function that takes positions (m,3) to the user's units, for messages
    Raises :class:`InputError` for a shape that is not closed: where more than 5 % of the surface has one side on both
    faces.
    """
    if not sides.closed:
        raise InputError(_refusal(sides, surface, place))
    return sides.sign(values)


def signed_mesh(
    values, wedges: np.ndarray, passing: np.ndarray, surface: LocalSurface, grid: Grid, progress=None
) -> Mesh:
    """The zero set of signed distances, (nx,ny,nz) float32 or Blocks, pulled onto the surface where that is within a
    cell, and smoothed over the gaps that it spans: closed, two faces at each edge, wound outwards.

    Near parts that the signs of nodes do not show (see :mod:`.signs.thin_parts`) the mesh starts off the surface, as a
    double cover does: around what is too thin, such as the ends of `wedges` (v,3), inside of slits. So flaps and inner
    walls have a face on either side, and along lines where sheets pass through one another, close to which are the
    samples `passing` (n,) bool, each wedge that lies inside has its own edge.
    """
    progress = Progress.of(progress)
    limit = np.float32(_CLAMP * grid.spacing)
    values = each(lambda u: np.clip(u, -limit, limit), values)
    thin = find_thin_parts(values, passing, surface, grid, progress.part(0.0, 0.1), wedges)
    vertices, faces = zero_set(values, thin, surface, grid, progress.part(0.1, 0.2))
    vertices = evened(vertices, faces)
    found = surface.project(vertices, progress.part(0.2, 0.7))
    on = found.distance <= grid.spacing
    vertices[on] = settled(vertices[on], found.step[on], surface, grid.spacing, progress.part(0.7, 0.8))
    mesh = mesh_of(vertices, faces)
    mesh = finished(mesh, passing, surface, grid.spacing, progress.part(0.8, 0.9))
    progress(0.92)
    _relax(mesh, np.flatnonzero(~on))
    progress(0.96)
    return pieces_with_samples(mesh, surface.tree, grid.spacing)


def _relax(mesh, loose):
    """Move the vertices `loose` of the mesh, in place, towards the middle of their neighbours."""
    links = mesh.edges.links()[loose]
    count = np.asarray(links.sum(axis=1))
    for _ in range(_SMOOTHING):
        mesh.vertices[loose] = (links @ mesh.vertices) / count


def _refusal(sides, surface, place):
    border = surface.rims.open
    if sides.within.mean() > 0.5 or not border.any():
        return (
            f"no signed distance: {sides.share:.0%} of the surface has the same side on both faces, as inner walls and "
            f"one-sided surfaces have, for instance near {spelt_out(place(sides.alike[:1])[0])}; set surface to single"
        )
    widest = np.where(border, surface.rims.opening, np.inf).argmin()
    raised = surface.bridge < options()["bridge"].metadata["limits"][1]
    close = f"raise bridge (now {surface.bridge:g}) until its holes close" if raised else "close its holes"
    return (
        f"the shape is not closed: the outside reaches both faces of {sides.share:.0%} of its surface, past "
        f"{border.sum()} border samples, for instance near {spelt_out(place(surface.points[[widest]])[0])}; set "
        f"surface to single, or {close}"
    )


def spelt_out(position: np.ndarray) -> str:
    """A position (3,) in a message."""
    return "({:.9g}, {:.9g}, {:.9g})".format(*position)
