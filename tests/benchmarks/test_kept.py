"""What was measured is taken as it was, as long as what it came from is the same."""

import pytest

from benchmarks import kept


@pytest.fixture
def source(tmp_path, monkeypatch):
    monkeypatch.setattr(kept, "_ROOT", tmp_path)
    monkeypatch.setattr(kept, "_LIBRARIES", {("*.py",): ("numpy", "no-such-library")})
    path = tmp_path / "code.py"
    path.write_text("x = 1")
    return path


def test_a_result_is_kept_until_the_code_or_the_case_changes(source, tmp_path):
    def measured(made_of="case 1"):
        calls.append(made_of)
        return {"cd": len(calls), "pair": (1, 2)}

    def once(made_of="case 1"):
        return kept.once(tmp_path / "folder" / "part.json", ("*.py",), made_of, lambda: measured(made_of))

    calls = []
    assert once() == once() == {"cd": 1, "pair": [1, 2]}
    assert once("case 2")["cd"] == 2
    source.write_text("x = 2")
    assert once("case 2")["cd"] == 3
    assert once("case 2")["cd"] == 3


def test_a_failure_is_not_kept(source, tmp_path):
    with pytest.raises(ZeroDivisionError):
        kept.once(tmp_path / "part.json", ("*.py",), "", lambda: 1 / 0)
    assert kept.once(tmp_path / "part.json", ("*.py",), "", lambda: {"cd": 1}) == {"cd": 1}


def test_versions_are_of_files_that_are_there():
    for sources in (kept.OURS, kept.PEERS):
        assert all(any(kept._ROOT.glob(pattern)) for pattern in sources)
        assert len(kept.code_version(sources)) == 8
    assert kept.code_version(kept.OURS) != kept.code_version(kept.PEERS)
