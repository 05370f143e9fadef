import time

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from core import InputError
from core.io.points import read_points, read_scan

numbers = st.floats(width=64, allow_nan=True, allow_infinity=True)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("text")


def written(folder, name, text):
    path = folder / name
    path.write_bytes(text.encode("utf-8"))
    return path


def refusal(folder, name, text):
    with pytest.raises(InputError) as caught:
        read_points(written(folder, name, text))
    assert "\n" not in str(caught.value)
    return str(caught.value)


@settings(deadline=None)
@given(
    arrays(np.float64, st.tuples(st.integers(1, 8), st.integers(3, 6)), elements=numbers),
    st.sampled_from(["\n", "\r\n"]),
    st.sampled_from([" ", "\t", "  \t ", ",", ", ", ";", " ; "]),
    st.sampled_from(["", "\ufeff", "# x y z\n", "// scan 7; a, b\n\n", "x{0}y{0}z\n", "count\n", "plain words\n"]),
    st.sampled_from(["", "\n", "\n\n  \n# end"]),
)
def test_round_trip(folder, table, newline, mark, head, tail):
    rows = "\n".join(mark.join(repr(float(x)) for x in row) for row in table)
    head = f"{len(table)}\n" if head == "count\n" else head.format(mark)
    path = written(folder, "scan.xyz", (head + rows + tail).replace("\n", newline))
    np.testing.assert_array_equal(read_points(path), table[:, :3])


def test_comments_and_blank_lines_anywhere(folder):
    text = "# a\n\n1 2 3 # b\n  \n// c\n4 5 6 // d\n"
    assert read_points(written(folder, "scan.txt", text)).tolist() == [[1, 2, 3], [4, 5, 6]]


def test_named_columns_are_found_wherever_they_stand(folder):
    text = 'id,label,"Y","X","Z",intensity\n7,wall,2,1,3,9\n8,floor,5,4,6,9\n'
    assert read_points(written(folder, "scan.csv", text)).tolist() == [[1, 2, 3], [4, 5, 6]]


@pytest.mark.parametrize(
    "text",
    [
        "X (m)\tY (m)\tZ (m)\tR\n1\t2\t3\t9\n4\t5\t6\t9\n",
        "label of it\tX\tY\tZ\na wall\t1\t2\t3\nfloor\t4\t5\t6\n",
        "X [m] Y [m] Z [m] R\n1 2 3 9\n4 5 6 9\n",
        'id,"X [m]","Y [m]","Z [m]"\n7,1,2,3\n8,4,5,6\n',
        "x\t y\tz\n1 2 3\n4 5 6\n",
        "1\t\t2\t3\n4\t\t5\t6\n",
    ],
)
def test_tabs_and_units_do_not_hide_columns(folder, text):
    assert read_points(written(folder, "scan.txt", text)).tolist() == [[1, 2, 3], [4, 5, 6]]


@pytest.mark.parametrize(
    "text",
    [
        "\tx\ty\tz\n0\t1\t2\t3\n1\t4\t5\t6\n",
        " x y z\n0 1 2 3\n1 4 5 6\n",
        "    x   y   z\n0   1   2   3\n10  4   5   6\n",
        '"x" "y" "z"\n"1" 1 2 3\n"2" 4 5 6\n',
        ",x,y,z\n0,1,2,3\n1,4,5,6\n",
    ],
    ids=["pandas, tabs", "pandas, blanks", "pandas, printed", "R", "commas"],
)
def test_names_of_rows_are_no_coordinates(folder, text):
    assert read_points(written(folder, "scan.txt", text)).tolist() == [[1, 2, 3], [4, 5, 6]]


@pytest.mark.parametrize(
    "text",
    [
        "label\tx\ty\tz\ti\nwall\t1\t2\t3\t9\n\t4\t5\t6\t9\n",
        "id\tlabel\tx\ty\tz\ti\n1\t\t1\t2\t3\t9\n2\t\t4\t5\t6\t9\n",
        "label\tx\ty\tz\ti\nwall\t1\t2\t3\t\nfloor\t4\t5\t6\t9\n",
        "#\tX\tY\tZ\tIntensity\n1\t2\t3\t128\n4\t5\t6\t128\n",
        'label,x,y,z\nwall,1,2,3\n"a, b",4,5,6\n',
        "label\tx\ty\tz\nwall, north\t1\t2\t3\nfloor\t4\t5\t6\n",
        "x,y,z,note\n1,2,3,a;b\n4,5,6,c\n",
        '"name, all of it",x,y,z\n7,1,2,3\n8,4,5,6\n',
        'x,y,z,label\n1,2,3,"6 inch\n4,5,6,"\n',
        "  x   y   z\n  1   2   3   9\n  4   5   6   9\n",
        "x y z\n1 2 3 9\n4 5 6 9\n",
        " x y z\n1.0 2.0 3.0 9\n4.0 5.0 6.0 9\n",
    ],
)
def test_header_and_rows_say_together_what_parts_their_cells(folder, text):
    assert read_points(written(folder, "scan.txt", text)).tolist() == [[1, 2, 3], [4, 5, 6]]


def test_many_columns_of_other_names_are_refused(folder):
    message = refusal(folder, "scan.csv", "Point,Easting,Northing,Elevation\n1,2,3,4\n")
    assert "4 columns, named Point, Easting, Northing, Elevation; name those of the coordinates x, y and z" in message
    three = written(folder, "scan.csv", "Easting,Northing,Elevation\n1,2,3\n4,5,6\n")
    assert read_points(three).tolist() == [[1, 2, 3], [4, 5, 6]]


@pytest.mark.parametrize("head", ["id,x,y", "x,y,intensity", "z,x,height", "nx,ny,nz", "Red,Green,Blue", "R G B"])
def test_three_columns_that_are_named_as_other_things_are_refused(folder, head):
    text = f"{head}\n1.5{' ' if ' ' in head else ','}2{' ' if ' ' in head else ','}3\n"
    assert "has 3 columns, named" in refusal(folder, "named.csv", text)


@pytest.mark.parametrize(
    ("text", "points"),
    [
        ("0,1,2\n1.5,2,3\n4,5,6\n", [[1.5, 2, 3], [4, 5, 6]]),
        ("0;1;2\n1.5;2;3\n4;5;6\n", [[1.5, 2, 3], [4, 5, 6]]),
        ("0\t1\t2\n1.5\t2\t3\n4\t5\t6\n", [[1.5, 2, 3], [4, 5, 6]]),
        ("0,1,2,3\n1.5,2,3,7\n", [[1.5, 2, 3]]),
        ("0,1,2\n3,4,5\n", [[0, 1, 2], [3, 4, 5]]),
        ("0 1 2\n1.5 2 3\n", [[0, 1, 2], [1.5, 2, 3]]),
        ("0,1,2\n", [[0, 1, 2]]),
    ],
)
def test_a_row_that_numbers_the_columns_is_no_point(folder, text, points):
    assert read_points(written(folder, "numbered.csv", text)).tolist() == points


@pytest.mark.parametrize(
    ("name", "text", "expected"),
    [
        ("a.csv", "X,Y,Z,R,G,B,Scalar field\n1,2,3,9,8,7,.5\n4,5,6,0,255,6,1\n", "red green blue Scalar_field"),
        ("a.txt", "//X Y Z Red Green Blue Intensity Nx Ny Nz\n1 2 3 9 8 7 .5 0 0 1\n4 5 6 0 255 6 1 0 0 1\n", "rgbi"),
        ("a.xyz", "# x y z intensity\n1 2 3 .5\n4 5 6 1\n", "intensity"),
        ("a.pts", "2\n1 2 3 .5 9 8 7\n4 5 6 1 0 255 6\n", "intensity red green blue"),
        ("a.pts", "1 2 3 .5\n4 5 6 1\n", "intensity"),
        ("a.csv", "intensity,z,label,x,y\n.5,3,wall,1,2\n1,6,floor,4,5\n", "intensity"),
        ("a.xyz", "1 2 3 9 8 7\n4 5 6 0 255 6\n", "red green blue"),
        ("a.pts", "2\n1 2 3 9 8 7\n4 5 6 0 255 6\n", "red green blue"),
        ("a.txt", "1;2;3;9;8;7;.5\n4;5;6;0;255;6;1\n", "red green blue"),
        ("a.txt", "1 2 3 9 8 7 6\n4 5 6 0 255 6 7\n", ""),
        ("a.txt", "1 2 3 0 0 1\n4 5 6 0 1 0\n", ""),
        ("a.txt", "1 2 3 0 0 1\n4 5 6 0 .6 .8\n", ""),
        ("a.txt", "1 2 3 9 8 7\n4 5 6 0 256 6\n", ""),
        ("a.txt", "1 2 3 9 8 7\n4 5 6 0 255 wall\n", ""),
        ("a.xyz", "# x y z of the whole house\n1 2 3 9\n4 5 6 9\n", ""),
        ("a.xyz", "1 2 3 # z y x\n4 5 6 # z y x\n", ""),
        ("a.csv", "x,y,z,intensity\n1,2,3,.5\n4,5,6,\n", ""),
        ("a.pts", "1 2 3 .1 .2 .3 1\n4 5 6 wall\n", ""),
    ],
)
def test_named_columns_are_carried(folder, name, text, expected):
    points, carried = read_scan(written(folder, name, text))
    assert points.tolist() == [[1, 2, 3], [4, 5, 6]]
    expected = "red green blue intensity" if expected == "rgbi" else expected
    assert list(carried) == expected.split()
    values = {"red": [9, 0], "green": [8, 255], "blue": [7, 6]}
    for name, found in carried.items():
        assert found.tolist() == values.get(name, [0.5, 1])
        assert found.dtype == (np.uint8 if name in values else np.float64)


def test_colours_that_are_no_bytes_stay_what_they_are(folder):
    for red in (0.5, 256, -1, float("nan"), float("inf")):
        carried = read_scan(written(folder, "scan.csv", f"x,y,z,r,g,b\n1,2,3,{red},0,1\n"))[1]
        assert all(carried[name].dtype == np.float64 for name in ("red", "green", "blue"))
        np.testing.assert_array_equal(carried["red"], [red])


@pytest.mark.parametrize(
    "text", ["Point Id X Y Z Intensity\n1 .5 .6 .7 100\n2 1.5 1.6 1.7 90\n", "Scan Pos X Y Z\n7 1 2 3\n8 4 5 6\n"]
)
def test_names_with_blanks_between_blanks_are_refused(folder, text):
    (folder / "scan.txt").write_text(text)
    with pytest.raises(InputError, match=r"names \d columns .*, but has \d; give names without blanks"):
        read_points(folder / "scan.txt")
    (folder / "scan.txt").write_text("X Y Z in metres\n1 2 3\n4 5 6\n")
    assert read_points(folder / "scan.txt").tolist() == [[1, 2, 3], [4, 5, 6]]
    (folder / "scan.txt").write_text(text.replace(" Id", "_Id").replace(" Pos", "_Pos"))
    assert read_points(folder / "scan.txt").shape == (2, 3)


def test_no_points_but_names(folder):
    assert "holds no points" in refusal(folder, "scan.csv", "x,y,z,intensity\n")


def test_text_in_further_columns_is_ignored(folder):
    path = folder / "scan.txt"
    path.write_bytes(b"1 2 3 caf\xe9\n4 5 6 wall\n")
    assert read_points(path).tolist() == [[1, 2, 3], [4, 5, 6]]


@pytest.mark.parametrize("bad", ["4 five 6", "4 5", "four five six", "4 5 1,5,2", "1.#NEW 2 3", "x" * 500])
@pytest.mark.parametrize("line", [2, 5])
def test_a_bad_line_is_named_by_its_number(folder, bad, line):
    lines = ["1 2 3", "# comment", "", "1 2 3", "1 2 3"]
    lines[line - 1] = bad
    message = refusal(folder, "scan.xyz", "\n".join(lines))
    assert f"line {line} is '{bad[:10]}" in message
    assert len(message) < len(str(folder)) + 200


@pytest.mark.parametrize("head", ["Point#,X,Y,Z", "Pt #,X,Y,Z", "#,X,Y,Z", "a://b,X,Y,Z"])
def test_marks_of_comments_may_stand_in_names(folder, head):
    points, attributes = read_scan(written(folder, "scan.csv", head + "\n1,10,20,30\n2,11,21,31 # seen\n"))
    assert points.tolist() == [[10, 20, 30], [11, 21, 31]]
    assert [values.tolist() for values in attributes.values()] == [[1, 2]]


@pytest.mark.parametrize("hole", [1, 2, 3])
@pytest.mark.parametrize("cell", ["", "none"])
def test_a_cell_without_a_number_costs_no_other_column(folder, hole, cell):
    rows = [f"{k},0,0,{k},2,3,{cell if k == hole else 5}" for k in (1, 2, 3)]
    path = written(folder, "scan.csv", "\n".join(["x,y,z,red,green,blue,class", *rows]))
    points, attributes = read_scan(path)
    assert points[:, 0].tolist() == attributes["red"].tolist() == [1, 2, 3]
    assert list(attributes) == ["red", "green", "blue"]
    assert all(values.dtype == np.uint8 for values in attributes.values())


def test_columns_of_one_name_or_of_none_in_ascii_are_told_apart(folder):
    path = written(folder, "scan.csv", "x,y,z,i,i,Größe,Gr  e,强度,X\n" + ",".join("123456789"))
    attributes = read_scan(path)[1]
    assert {name: values.item() for name, values in attributes.items()} == {
        "i": 4, "i_2": 5, "Gr_e": 6, "Gr_e_2": 7, "column_8": 8, "x_2": 9,
    }  # fmt: skip


def test_letters_beside_colours_stay_what_they_are(folder):
    attributes = read_scan(written(folder, "scan.csv", "x,y,z,r,g,b,red\n1,2,3,4,5,6,7"))[1]
    assert {name: values.item() for name, values in attributes.items()} == {"r": 4, "g": 5, "b": 6, "red": 7}


def test_a_table_of_words_is_refused(folder):
    assert "line 2 is 'anna,red,oslo'" in refusal(folder, "scan.csv", "name,colour,town\nanna,red,oslo\n")
    assert "line 2 is" in refusal(folder, "scan.txt", "Dear reader,\nthis is a letter\n")


@pytest.mark.parametrize("count", [0, 1, 3, 10**15])
def test_a_wrong_count_is_refused(folder, count):
    advice = "is it cut off?" if count > 2 else "correct that number, or leave out such lines"
    message = refusal(folder, "scan.pts", f"{count}\n1 2 3\n4 5 6\n")
    assert f"says {count} points in its first line, but 2 follow; {advice}" in message


def test_blocks_of_points_are_read_one_after_the_other(folder):
    text = "2\n1 2 3\n4 5 6\n\n0\n# the next view\n1\n7 8 9\n"
    assert read_points(written(folder, "scan.pts", text)).tolist() == [[1, 2, 3], [4, 5, 6], [7, 8, 9]]


@pytest.mark.parametrize("end", ["3\n7 8 9\n", "0\n7 8 9\n"])
def test_a_wrong_count_of_a_block_is_refused(folder, end):
    message = refusal(folder, "scan.pts", "2\n1 2 3\n4 5 6\n" + end)
    assert f"says {2 + int(end[0])} points in 2 blocks, but 3 follow" in message


def test_a_block_that_is_too_short_is_named_by_the_line_after_it(folder):
    assert "line 3 is '2'" in refusal(folder, "scan.pts", "2\n1 2 3\n2\n4 5 6\n7 8 9\n")
    assert "line 1 is '9" in refusal(folder, "scan.pts", "9" * 5000 + "\n1 2 3\n")


@pytest.mark.parametrize("text", ["\n\n", "# only\n", "x y z\n", "0\n"])
def test_no_points(folder, text):
    assert "holds no points" in refusal(folder, "scan.xyz", text)


def test_obj_takes_vertices_only(folder):
    text = "# o\nmtllib a.mtl\nv 1 2 3\nv\t4 5 6 0.5 0.5 0.5\nvn 0 0 1\nvt 0 0\n  v 7 8 9 1 # w\nf 1//1 2//1 3//1\n"
    assert read_points(written(folder, "scan.obj", text)).tolist() == [[1, 2, 3], [4, 5, 6], [7, 8, 9]]


def test_obj_refusals(folder):
    assert "line 3 is 'v 1 2'" in refusal(folder, "scan.obj", "o thing\nv 1 2 3\nv 1 2\n")
    assert "holds no points" in refusal(folder, "scan.obj", "o thing\nvn 1 2 3\n")


def test_a_million_rows_in_seconds(folder):
    path = written(folder, "scan.xyz", "1.25 -2.5 3.75\n" * 1_000_000)
    start = time.perf_counter()
    points = read_points(path)
    assert time.perf_counter() - start < 5
    assert points.shape == (1_000_000, 3)
    path.unlink()


def test_reads_what_spreadsheets_write_as_unicode_text(folder):
    path = folder / "wide.txt"
    path.write_bytes("x\ty\tz\r\n1\t2\t3\r\n4\t5\t6.5\r\n".encode("utf-16"))
    np.testing.assert_array_equal(read_points(path), [[1, 2, 3], [4, 5, 6.5]])


@pytest.mark.parametrize(
    "text",
    [
        "1,5;2;-3,5e0\n4;5;6\n",
        "1,5 2 -3,5 7\n4 5 6 7\n",
        "1,5\t2\t-3,5\n4\t5\t6,0\n",
        "x;y;z;name\n1,5;2;-3,5;a,b\n4;5;6;c\n",
        "1.5, 2 ,-3.5\n4, 5 ,6\n",
        "1.5 ,2 ,-3.5\n4 ,5 ,6\n",
        "x, y, z\n1.5, 2, -3.5\n4, 5, 6\n",
    ],
)
def test_commas_are_decimal_where_something_else_parts_the_numbers(folder, text):
    assert read_points(written(folder, "scan.txt", text)).tolist() == [[1.5, 2, -3.5], [4, 5, 6]]
    whole_numbers_first = "\n".join([*text.split("\n")[::-1][1:]])
    if "x" not in text:
        found = read_points(written(folder, "scan.txt", whole_numbers_first))
        assert found.tolist() == [[4, 5, 6], [1.5, 2, -3.5]]


@pytest.mark.parametrize(
    "text",
    [
        '"x","y","z"\n"1","2","3"\n"4","5","6"\n',
        '"1","2","3"\n"4","5","6"\n',
        '"name";"x";"y";"z"\n"a;b";"1";"2";"3"\n"c";"4";"5";"6"\n',
        "sep=;\nx;y;z\n1;2;3\n4;5;6\n",
        '"sep=,"\n1,2,3\n4,5,6\n',
    ],
)
def test_quotes_and_separators_of_spreadsheets(folder, text):
    assert read_points(written(folder, "scan.csv", text)).tolist() == [[1, 2, 3], [4, 5, 6]]


@pytest.mark.parametrize("spelling", ["nan", "-nan(ind)", "nan(snan)", "1.#QNAN", "1.#INF00", "-1.#IND000000"])
def test_what_is_not_a_number_is_kept_as_that(folder, spelling):
    for text in (f"1 2 {spelling}\n4 5 6 # seen\n", f"4 5 6\n1,2,{spelling}\n".replace(" ", ",")):
        points = read_points(written(folder, "scan.xyz", text))
        assert np.isnan(points).sum() == 1
        assert points[~np.isnan(points)].tolist() in ([1, 2, 4, 5, 6], [4, 5, 6, 1, 2])
