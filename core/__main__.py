"""`python -m core`."""

import os
import signal
import sys

from .exit_status import BAD_INPUT, CANCELLED

if sys.stderr is None:  # closed
    sys.stderr = open(os.devnull, "w")  # noqa: SIM115  until the end
if sys.stdout is not None:
    sys.stdout.reconfigure(errors="backslashreplace")  # file names need not be text
try:
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    from .cli import main

    status = main()
    if sys.stdout is not None:
        sys.stdout.flush()
except KeyboardInterrupt:  # while modules are loaded
    sys.stderr.write("error: cancelled\n")
    status = CANCELLED
except OSError as error:  # what is printed goes to a full disk, or nobody reads it; all files are written by then
    sys.stderr.write(f"error: standard output cannot be written to ({error.strerror}); check where it goes\n")
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    status = BAD_INPUT
sys.exit(status)
