"""Tables and comparisons of made-up results."""

from benchmarks.report import ABSENT, NORMALS, SURFACE, comparison, markdown_table, markdown_tables, terminal_row


def result(case="a", cd=1.0, nc=0.9, **more) -> dict:
    return {"case": case, "mesh": {"cd": cd}, "normals": {"nc": nc}, **more}


def run(*cases, **settings) -> dict:
    return {"sampling": "uniform", "settings": settings, "cases": list(cases)}


def test_a_table_has_a_row_a_case_and_the_medians():
    lines = markdown_table([result("a", 1.0), result("b", 9.0), result("c", 2.0)], SURFACE).splitlines()
    assert [line.split(" | ")[:3] for line in lines] == [
        ["| case", "CD", "HD"],
        ["| ---", "---:", "---:"],
        ["| a", "1.000", ABSENT],
        ["| b", "9.000", ABSENT],
        ["| c", "2.000", ABSENT],
        ["| *median*", "2.000", ABSENT],
    ]
    assert len({line.count("|") for line in lines}) == 1


def test_tables_without_values_are_left_out():
    text = markdown_tables([{"case": "a", "normals": {"nc": 0.5}}])
    assert "## Normals" in text
    assert "## Double cover" not in text


def test_failed_cases_stay_visible():
    failed = {"case": "b", "error": "MemoryError: too much"}
    assert "MemoryError: too much" in terminal_row(failed)
    lines = markdown_table([result(), failed], NORMALS).splitlines()
    assert "| b | MemoryError: too much |" in lines[3]
    assert len({line.count("|") for line in lines}) == 1


def test_comparison_knows_which_way_is_better():
    lines = list(comparison(run(result(cd=1.0, nc=0.9)), run(result(cd=1.5, nc=0.95))))
    assert [line.split() for line in lines] == [
        ["a", "Double", "cover", "CD", "1.000", "->", "1.500", "worse", "(+50%", "to", "go)"],
        ["a", "Normals", "NC", "0.9000", "->", "0.9500", "better", "(-50%", "to", "go)"],
        ["1", "better,", "1", "worse"],
    ]


def test_comparison_leaves_small_changes_out_and_names_other_differences():
    lines = list(comparison(run(result(), result("b"), s=1), run(result(cd=1.01), result("c"), s=2)))
    assert lines == [
        "the runs differ in settings: {'s': 1} -> {'s': 2}",
        "c: not in the earlier run",
        "0 better, 0 worse",
    ]
    assert next(comparison(run(result()), run({"case": "a", "error": "E: x"}))) == "a: ran -> E: x"
