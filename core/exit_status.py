"""Exit statuses of the command line."""

DONE, BAD_INPUT, TOO_LARGE, CANCELLED = 0, 2, 3, 130
