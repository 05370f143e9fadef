"""The library's exceptions: one root, :class:`VADError`.

Every message names the value seen, the limit it broke and the remedy, in one line.
"""


class VADError(Exception):
    """Root of every error raised on purpose by this library."""


class InputError(VADError, ValueError):
    """Points, files or constraints that cannot be used as given."""


class SettingsError(VADError, ValueError):
    """A setting outside its documented range."""


class MissingDependency(VADError, ImportError):
    """An optional library is needed for what was asked and is not installed."""


class Cancelled(VADError):
    """The caller's progress callback returned False; nothing was written."""


class MemoryBudgetError(VADError, MemoryError):
    """A run that would need more memory than it may have; refused before its costly stages."""
