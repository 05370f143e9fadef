"""`python -m core`."""

import sys

from .cli import main

sys.stdout.reconfigure(errors="backslashreplace")  # file names need not be text
sys.exit(main())
