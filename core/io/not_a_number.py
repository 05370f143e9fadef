"""What is not a number, in the spellings of C libraries that Python does not read."""

import re

_SPELLINGS = re.compile(r"[-+]?(?:nan\(\w*\)|\d\.#(?:qnan|snan|ind|inf)\w*)", re.IGNORECASE)


def spelt_plainly(text: str) -> str:
    """The text with "nan" for each "-nan(ind)", "1.#QNAN", "-1.#IND", "1.#INF" and the like."""
    return _SPELLINGS.sub("nan", text) if "#" in text or "(" in text else text
