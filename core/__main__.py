"""`python -m core`."""

import os
import signal
import sys

from .exit_status import BAD_INPUT, CANCELLED, REQUESTS_TO_END

if sys.stderr is None:  # closed
    sys.stderr = open(os.devnull, "w")  # noqa: SIM115  until the end
if sys.stdout is not None:
    sys.stdout.reconfigure(errors="backslashreplace")  # file names need not be text
_asked_to_end = []


def _end(signum, frame):
    _asked_to_end.append(signum)
    raise KeyboardInterrupt


try:
    for number in REQUESTS_TO_END:
        if signal.getsignal(number) is not signal.SIG_IGN:
            signal.signal(number, _end)
    from .cli import main

    status = main()
    if sys.stdout is not None:
        sys.stdout.flush()
except (KeyboardInterrupt, ImportError) as error:  # while modules are loaded; NumPy makes an ImportError of it
    if isinstance(error, ImportError) and not _asked_to_end:
        raise
    sys.stderr.write("error: cancelled\n")
    sys.stderr.flush()
    os._exit(CANCELLED)  # Python's own end would be another one where the interrupt came within an exec()
except OSError as error:  # what is printed goes to a full disk, or nobody reads it; all files are written by then
    sys.stderr.write(f"error: standard output cannot be written to ({error.strerror}); check where it goes\n")
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    status = BAD_INPUT
sys.exit(status)
