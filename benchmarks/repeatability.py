"""How much the quality figures of a case differ when all of it is measured twice."""

_QUALITY = ("mesh", "sheet", "normals", "cd", "hd", "nc", "f005", "f010")
_COST = ("seconds", "cpu")
OURS = "ours"


def differences(first: dict, second: dict) -> dict[str, float]:
    """Largest |a - b| / max(|a|, |b|) over the numbers of two results of a case that say how good something is, of ours
    (surfaces and normals) and of each peer that did not fail, by name."""
    ours = _worst(*({key: result[key] for key in _QUALITY if key in result} for result in (first, second)))
    peers = {name: (found, second["peers"][name]) for name, found in first.get("peers", {}).items()}
    return {OURS: ours} | {name: _worst(*both) for name, both in peers.items() if "error" not in both[0]}


def _worst(first, second):
    return max((abs(a - b) / max(abs(a), abs(b)) for a, b in _pairs(first, second) if a != b), default=0.0)


def _pairs(first, second):
    """Numbers of the same name in both; one that is in one alone counts as 0 against 1."""
    for key in sorted(first.keys() | second.keys()):
        a, b = first.get(key), second.get(key)
        if isinstance(a, dict) and isinstance(b, dict):
            yield from _pairs(a, b)
        elif key not in (*_COST, "memory_mb", "variant") and isinstance(a if b is None else b, int | float):
            yield (a, b) if a is not None and b is not None else (0.0, 1.0)
