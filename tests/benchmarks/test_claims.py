"""The README says what the saved runs say."""

import json

from benchmarks.claims import END, README, START, claims, with_claims
from benchmarks.status import DOCS


def test_the_readme_is_up_to_date():
    text = README.read_text("utf-8")
    assert with_claims(text, claims(DOCS)) == text, "python -m benchmarks.claims writes it anew"


def measured(case, category, ours, other):
    peer = {"cd": other, "variant": None, "memory_mb": 0.25}
    single = {"cd": 9.0}
    time = {"total": 1.0, "cpu": 1.0}
    return {
        "case": case,
        "category": category,
        "mesh": {"cd": ours},
        "sheet": single,
        "memory_mb": 1.0,
        "seconds": time,
        "peers": {"poisson": peer},
    }


def test_claims_count_what_was_measured(tmp_path):
    cases = [measured("a", "open", 1.0, 2.0), measured("b", "open", 3.0, 2.0), measured("c", "holes", 1.0, 2.0)]
    room = measured("room", "open", 1.0, 2.0) | {"peers": {"poisson": {"error": "not done"}}}
    ratios = [{"ratio": {"seconds": s, "cpu": 2 * s}} for s in (1.0, 1.25, 4.0)]
    (tmp_path / "bench").mkdir()
    run = {"cases": [*cases, room, {"case": "d", "error": "broke"}], "alone": dict(zip("abc", ratios, strict=True))}
    (tmp_path / "bench" / "uniform.json").write_text(json.dumps(run))
    text = claims(tmp_path)
    scores = "2 | 1, 50% | 1.50 | 1.25 | 2.50 | 4.0"
    assert f"| [shapes made by script](docs/bench.md), uniform | {scores} | `make bench-full` |" in text
    assert (
        "\nWith noise, strays, holes or wires it has the lowest CD on 1 of 1 cases.\nNo count has room, where" in text
    )
    assert "[development cases]" not in text
    assert with_claims(f"a\n{START}old\n{END}\nb", text) == f"a\n{START}{text}{END}\nb"
