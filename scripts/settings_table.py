"""The README's table of settings, from :class:`core.Settings`: `python -m scripts.settings_table` writes it anew."""

from pathlib import Path

from core.settings import default_in_words, options

README = Path(__file__).resolve().parent.parent / "README.md"
START, END = "<!-- settings -->\n", "<!-- /settings -->"


def settings_table() -> str:
    """A Markdown table with a row for each setting: name, default, what it may be, help."""
    rows = ["| Setting | Default | May be | What it does |", "|---|---|---|---|"]
    for name, option in options().items():
        rows.append(f"| `{name}` | `{default_in_words(option)}` | {_allowed(option)} | {option.metadata['help']} |")
    return "\n".join(rows) + "\n"


def _allowed(option):
    limits, choices, word, unit = (option.metadata[key] for key in ("limits", "choices", "word", "unit"))
    if choices:
        return ", ".join(f"`{choice}`" for choice in choices)
    if limits is None:
        return "`True`, `False`"
    return f"{limits[0]:.10g} to {limits[1]:.10g} {unit}".strip() + (f", or `{word}`" if word else "")


def main() -> None:
    before, rest = README.read_text().split(START)
    README.write_text(before + START + settings_table() + END + rest.split(END)[1])


if __name__ == "__main__":
    main()
