"""What counts as the same figure, and what is none."""

from benchmarks.repeatability import differences


def result(cd, nc=0.9, seconds=1.0, **peers):
    quality = {"cd": cd, "euler": 2, "least": None, "seconds": seconds, "cpu": 2 * seconds}
    made = {
        name: {"cd": value, "variant": 3, "memory_mb": 10 * seconds, "cpu": seconds} for name, value in peers.items()
    }
    return {"mesh": quality, "normals": {"nc": nc}, "seconds": {"total": seconds}, "peers": made, "points": 10}


def test_costs_do_not_count_and_the_worst_figure_does():
    assert differences(result(1.0, alpha=2.0), result(1.0, seconds=3.0, alpha=2.0)) == {"ours": 0.0, "alpha": 0.0}
    found = differences(result(1.0, nc=0.9, alpha=2.0), result(0.999, nc=0.45, alpha=2.5))
    assert found == {"ours": 0.5, "alpha": 0.2}


def test_a_figure_that_is_there_only_once_is_a_difference():
    once = result(1.0)
    del once["mesh"]["euler"]
    assert differences(result(1.0), once) == {"ours": 1.0}
    failed = result(1.0, alpha=2.0)
    failed["peers"]["alpha"] = {"error": "no"}
    assert differences(failed, result(1.0, alpha=2.0)) == {"ours": 0.0}
