import io
from contextlib import suppress

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from plyfile import PlyData, PlyElement, PlyListProperty

from core import InputError
from core.io.points import read_points, read_scan

FORMATS = {"ascii": dict(text=True), "little": dict(byte_order="<"), "big": dict(byte_order=">")}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("ply")


def vertices(points, kind="f8", extra=(), order="xyz", listed=False):
    records = np.zeros(len(points), [(n, kind) for n in order] + list(extra) + [("tags", "O")] * listed)
    for k, axis in enumerate("xyz"):
        records[axis] = points[:, k]
    if listed:
        records["tags"] = [np.arange(i % 3, dtype="i4") for i in range(len(points))]
    return PlyElement.describe(records, "vertex")


def faces(count):
    records = np.empty(count, [("vertex_indices", "O")])
    records["vertex_indices"] = [np.arange(3 + i % 2, dtype="i4") for i in range(count)]
    return PlyElement.describe(records, "face")


def cameras():
    return PlyElement.describe(np.array([(1, 2.5)], [("id", "i4"), ("focal", "f8")]), "camera")


def ply(elements, **form):
    """Rows with lists are packed here: plyfile 1.1 forgets the byte order of the scalars among them."""
    data = PlyData(elements, **form)
    if data.text:
        stream = io.BytesIO()
        data.write(stream)
        return stream.getvalue()
    rows = ((row, element.properties) for element in data for row in element.data)
    packed = (
        packed_value(value, p, data.byte_order) for row, kinds in rows for value, p in zip(row, kinds, strict=True)
    )
    return (data.header + "\n").encode() + b"".join(packed)


def packed_value(value, kind, byte_order):
    if not isinstance(kind, PlyListProperty):
        return np.asarray(value, kind.dtype(byte_order)).tobytes()
    count, entry = kind.list_dtype(byte_order)
    return np.asarray(len(value), count).tobytes() + np.asarray(value, entry).tobytes()


def written(folder, content):
    (folder / "scan.ply").write_bytes(content)
    return folder / "scan.ply"


def refusal(folder, content):
    with pytest.raises(InputError) as caught:
        read_points(written(folder, content))
    assert "\n" not in str(caught.value)
    return str(caught.value)


@settings(deadline=None)
@given(
    st.sampled_from(["f4", "f8"]).flatmap(lambda kind: arrays(kind, st.tuples(st.integers(1, 6), st.just(3)))),
    st.sampled_from(sorted(FORMATS)),
    st.sampled_from(["xyz", "zxy"]),
    st.sampled_from([(), (("red", "u1"),), (("nx", "f4"), ("label", "i2"))]),
    st.booleans(),
    st.sampled_from(["", "faces after", "faces before", "cameras before", "cameras around"]),
)
def test_round_trip(folder, points, form, order, extra, listed, others):
    elements = [vertices(points, points.dtype.str[1:], extra, order, listed)]
    if others.startswith("cameras"):
        elements.insert(0, cameras())
    if others == "faces before":
        elements.insert(0, faces(3))
    if others in ("faces after", "cameras around"):
        elements.append(faces(4))
    path = written(folder, ply(elements, **FORMATS[form]))
    np.testing.assert_array_equal(read_points(path), points.astype(np.float64))
    found = read_scan(path)[1]
    assert {name: values.dtype.str[1:] for name, values in found.items()} == {
        name: kind for name, kind in extra if name != "nx"
    }
    assert all(len(values) == len(points) for values in found.values())


@pytest.mark.parametrize("newline", [b"\n", b"\r\n", b"\r"])
@pytest.mark.parametrize("form", FORMATS)
def test_line_ends_comments_and_objects_in_the_header(folder, newline, form):
    points = np.arange(12.0).reshape(4, 3)
    content = ply([vertices(points), faces(2)], comments=["element vertex 99", "made by hand"], **FORMATS[form])
    head, _, body = content.partition(b"end_header\n")
    head = head.replace(b"by hand", b"by J\xc3\xbcrgen \xe9")
    content = head.replace(b"\n", newline) + b"end_header" + newline
    content += body.replace(b"\n", newline) if form == "ascii" else body
    np.testing.assert_array_equal(read_points(written(folder, content)), points)


@pytest.mark.parametrize("form", FORMATS)
def test_names_that_are_not_in_ascii_are_written_so(folder, form):
    content = ply([vertices(np.eye(3), extra=(("height", "f4"), ("hight", "f4")))], **FORMATS[form])
    for name, other in ((b" height", "scalar_Höhe".encode()), (b" hight", "scalar_Hähe".encode("latin-1"))):
        content = content.replace(name, b" " + other)
    points, found = read_scan(written(folder, content))
    assert np.array_equal(points, np.eye(3))
    assert list(found) == ["scalar_H_he", "scalar_H_he_2"]


@pytest.mark.parametrize("others", [[], [faces(3)]])
@pytest.mark.parametrize("form", FORMATS)
def test_truncation_within_the_vertices_is_refused(folder, form, others):
    whole = ply([vertices(np.random.default_rng(0).normal(size=(9, 3))), *others], **FORMATS[form])
    start = whole.index(b"end_header\n") + len(b"end_header\n")
    end = whole.index(b"\n3 0 1 2") - 20 if others and form == "ascii" else start + 9 * 24 - 1
    for length in range(1, end, 5):
        refusal(folder, whole[:length])


@pytest.mark.parametrize("claim", [b"11", b"4000000000", b"9" * 30, b"-1", b"ten", b""])
@pytest.mark.parametrize("form", FORMATS)
def test_a_header_that_claims_what_is_not_there(folder, form, claim):
    content = ply([vertices(np.ones((10, 3)))], **FORMATS[form])
    refusal(folder, content.replace(b"element vertex 10", b"element vertex " + claim))


@pytest.mark.parametrize("form", FORMATS)
def test_a_header_that_claims_more_faces_than_there_can_be(folder, form):
    content = ply([vertices(np.ones((10, 3))), faces(2)], **FORMATS[form])
    message = refusal(folder, content.replace(b"element face 2", b"element face 20000000000"))
    assert "claims" in message


@pytest.mark.parametrize("form", FORMATS)
def test_a_header_that_hides_points(folder, form):
    content = ply([vertices(np.ones((10, 3)))], **FORMATS[form])
    assert "more data follows" in refusal(folder, content.replace(b"element vertex 10", b"element vertex 9"))


def test_an_ascii_row_that_is_not_numbers_is_named(folder):
    content = ply([vertices(np.ones((10, 3)))], text=True).replace(b"1 1 1\n1 1 1\n", b"1 1 1\n1 x 1\n", 1)
    assert "row 1" in refusal(folder, content)


def test_missing_elements_and_properties_are_named(folder):
    assert "no element 'vertex'" in refusal(folder, ply([faces(2)], byte_order="<"))
    flat = PlyElement.describe(np.ones(3, [("x", "f4"), ("y", "f4")]), "vertex")
    assert "['x', 'y']" in refusal(folder, ply([flat], byte_order="<"))
    listed = np.empty(1, [("x", "f4"), ("y", "f4"), ("z", "O")])
    listed[0] = 1, 1, np.ones(2)
    assert "['x', 'y']" in refusal(folder, ply([PlyElement.describe(listed, "vertex")], byte_order="<"))


def test_no_vertices(folder):
    assert "holds no points" in refusal(folder, ply([vertices(np.ones((0, 3))), faces(2)], byte_order="<"))


@pytest.mark.parametrize("content", [b"plyx\n", b"ply\n", b"ply\nformat ascii 2.0\nend_header\n", b"ply\nend_header\n"])
def test_bad_headers(folder, content):
    refusal(folder, content)


@pytest.mark.parametrize("form", FORMATS)
def test_damage_in_the_header_is_refused_or_harmless(folder, form):
    rng = np.random.default_rng(0)
    whole = ply([vertices(rng.normal(size=(9, 3)), extra=[("red", "u1")]), faces(3)], **FORMATS[form])
    for place in range(whole.index(b"end_header") + 12):
        damaged = bytearray(whole)
        damaged[place] ^= rng.integers(1, 256)
        with suppress(InputError):
            assert read_points(written(folder, damaged)).shape[1] == 3


@pytest.mark.parametrize("form", sorted(FORMATS))
@pytest.mark.parametrize(
    ("written_as", "instead"),
    [
        (b"ply\n", b"\xef\xbb\xbfply\n"),
        (b"ply\n", b"PLY \n"),
        (b"end_header\n", b"end_header \t\n"),
        (b"\nelement", b" \n\n \t\n  element"),
        (b"property double z", b"property double Z"),
    ],
)
def test_headers_that_other_programs_read(folder, form, written_as, instead):
    points = np.array([[1, 2, 3], [4, 5, 6.5]])
    content = ply([vertices(points), faces(1)], **FORMATS[form])
    assert content.count(written_as) == 1 or written_as == b"\nelement"
    np.testing.assert_array_equal(read_points(written(folder, content.replace(written_as, instead))), points)


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("form", FORMATS)
def test_empty_lists_among_the_vertices_are_nothing_to_warn_of(folder, form):
    points = np.arange(9.0).reshape(3, 3)
    content = ply([vertices(points, listed=True)], **FORMATS[form])
    np.testing.assert_array_equal(read_points(written(folder, content)), points)


def test_blank_lines_and_what_is_not_a_number_in_text(folder):
    content = ply([vertices(np.array([[1, 2, 3], [4, 5, 6.5], [7, 8, 9]])), faces(1)], text=True)
    content = content.replace(b"6.5", b"-nan(ind)\n \n").replace(b"7 8", b"1.#QNAN 8")
    np.testing.assert_array_equal(read_points(written(folder, content)), [[1, 2, 3], [4, 5, np.nan], [np.nan, 8, 9]])


def in_text(properties, rows):
    names = "".join(f"property {kind} {name}\n" for name, kind in properties.items())
    return f"ply\nformat ascii 1.0\nelement vertex {len(rows)}\n{names}end_header\n".encode() + "\n".join(rows).encode()


def test_all_digits_in_text_count_whatever_the_header_declares(folder):
    kinds = dict(x="float", y="float", z="float", depth="float")
    points, attributes = read_scan(written(folder, in_text(kinds, ["512345.6781 5400000.1234 300.25 0.1"])))
    assert points.tolist() == [[512345.6781, 5400000.1234, 300.25]]
    assert (attributes["depth"].dtype, attributes["depth"][0]) == (np.float32, np.float32(0.1))


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize(
    ("kind", "cell", "held"),
    [
        *(("uchar", "255.0", np.uint8), ("uchar", "300", None), ("char", "-129", None), ("uint", "-1", None)),
        *(("int", "2.5", None), ("float", "1e39", None), ("float", "inf", np.float32), ("short", "nan", None)),
    ],
)
def test_what_a_declared_type_does_not_hold_stays_what_it_is(folder, kind, cell, held):
    row = f"1 2 3 {cell}"
    kinds = dict(x="int", y="int", z="int", further=kind)
    points, attributes = read_scan(written(folder, in_text(kinds, [row])))
    assert points.tolist() == [[1, 2, 3]]
    assert attributes["further"].dtype == (held or np.float64)
    np.testing.assert_array_equal(attributes["further"], [float(cell)])
