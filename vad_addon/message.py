"""Messages longer than the sidebar is wide."""

import textwrap

SIDEBAR_WIDTH = 36  # characters beside the icon, at Blender's default width of the sidebar


def draw_message(layout, text: str, icon: str, width: int = SIDEBAR_WIDTH) -> None:
    """Write `text` over as many lines of `width` characters as it needs; Blender itself would cut out its middle."""
    column = layout.column(align=True)
    for number, line in enumerate(textwrap.wrap(text, width)):
        column.label(text=line, icon="BLANK1" if number else icon)
