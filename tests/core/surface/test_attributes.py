from dataclasses import replace

import numpy as np
import pytest

from core import InputError, Mesh, Settings, reconstruct
from core.surface.attributes import residuals, sample_attributes, vertex_attributes
from tests import shapes


def test_distance_is_how_far_the_vertices_are_off_the_surface(sphere_run):
    found = vertex_attributes(sphere_run.surface, sphere_run)["distance"]
    assert np.abs(found - shapes.sphere_distance(sphere_run.surface.vertices)).max() < 0.1 * sphere_run.field.spacing
    moved = Mesh(sphere_run.surface.vertices * 1.3, sphere_run.surface.faces)
    assert residuals(moved, sphere_run) == pytest.approx(shapes.sphere_distance(moved.vertices), abs=0.02)


def test_distance_has_no_sign_inside_a_signed_field():
    run = reconstruct(shapes.sphere(500), Settings(resolution=24, surface="signed"))
    inner = Mesh(run.surface.vertices * 0.7, run.surface.faces)
    assert residuals(inner, run) == pytest.approx(0.3, abs=0.05)


def test_what_points_carry_comes_from_the_nearest_sample_by_its_row_in_the_input(sphere_run, random):
    """Twice as many input rows as samples, in another order; values tell the row."""
    row = random.permutation(3000)[:1500]
    run = replace(sphere_run, source_index=row, report={"counts": {"input": 3000}}, confidence=random.random(1500))
    mesh = Mesh(run.surface.vertices[::50], np.zeros((0, 3), np.int32))
    far = mesh.vertices[:, None] - run.points[None]
    nearest = np.einsum("vni,vni->vn", far, far).argmin(axis=1)
    label, colour = np.arange(3000, dtype=np.uint16), random.integers(0, 256, (3000, 3), np.uint8)
    found = vertex_attributes(mesh, run, {"label": label, "colour": colour, "confidence": label})
    assert list(found) == ["distance", "confidence", "label", "colour", "scan_confidence"]
    np.testing.assert_array_equal(found["scan_confidence"], found["label"])
    np.testing.assert_array_equal(found["label"], row[nearest])
    np.testing.assert_array_equal(found["colour"], colour[row[nearest]])
    np.testing.assert_array_equal(found["confidence"], run.confidence[nearest].astype(np.float32))
    assert [values.dtype.name for values in found.values()] == ["float32", "float32", "uint16", "uint8", "uint16"]
    np.testing.assert_array_equal(sample_attributes(run, {"label": label})["label"], row)
    again = sample_attributes(run, {"confidence": label, "scan_confidence": colour})
    assert list(again) == ["confidence", "scan_confidence", "scan_scan_confidence"]
    np.testing.assert_array_equal(again["scan_scan_confidence"], colour[row])


def test_a_mesh_that_was_not_asked_for_is_refused(sphere_run):
    with pytest.raises(InputError, match="the mesh is None; give the surface or the sheet of a run whose setting"):
        vertex_attributes(None, sphere_run)


def test_what_is_masked_at_points_is_so_at_vertices(sphere_run):
    count = sphere_run.report["counts"]["input"]
    given = np.ma.masked_less(np.arange(count), count // 2)
    found = vertex_attributes(sphere_run.surface, sphere_run, {"class": given})["class"]
    np.testing.assert_array_equal(np.ma.getmaskarray(found), found.data < count // 2)
    assert 0 < np.ma.count_masked(found) < len(found)


def test_a_row_for_each_point_of_the_input_is_needed(sphere_run):
    for label, shape in ((np.zeros(1499), r"\(1499,\)"), (5, r"\(\)")):
        with pytest.raises(InputError, match=f"'label' has shape {shape}; give 1500 rows"):
            vertex_attributes(sphere_run.surface, sphere_run, {"label": label})
    with pytest.raises(InputError, match=r"'label' is no array \(.*\); give 1500 rows"):
        vertex_attributes(sphere_run.surface, sphere_run, {"label": [[1, 2, 3], [4, 5]]})
