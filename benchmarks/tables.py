"""Tables of the pages in docs/."""

from collections.abc import Iterable


def markdown_rows(rows: Iterable[Iterable[str]]) -> str:
    """A table in Markdown of rows of cells: its heads, how its columns are aligned, and the lines."""
    return "\n".join(f"| {' | '.join(row)} |" for row in rows)
