"""How the command line ends: its exit statuses, and the signals by which it is asked to."""

import signal

DONE, BAD_INPUT, TOO_LARGE, CANCELLED = 0, 2, 3, 130
REQUESTS_TO_END = tuple(getattr(signal, name) for name in ("SIGTERM", "SIGHUP") if hasattr(signal, name))
