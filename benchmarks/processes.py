"""Work in processes of its own: its memory is its own, and what crashes or takes too long there ends there."""

import os
import signal
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from multiprocessing import get_context, parent_process
from threading import Thread

_WARM = "forkserver" if sys.platform != "win32" else "spawn"
_THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS")
_LOADED_ONCE = ["open3d", "benchmarks.measure_peers"]


class Failed(Exception):
    """What went wrong in the other process, in one line."""


class TooSlow(Failed):
    """That it was not done within its limit."""


@contextmanager
def one_thread_each() -> Iterator[None]:
    """Libraries of processes begun meanwhile use one thread of OpenMP and BLAS each, as fits several at a time."""
    before = {name: os.environ.get(name) for name in _THREADS}
    os.environ.update(dict.fromkeys(_THREADS, "1"))
    try:
        yield
    finally:
        for name, value in before.items():
            os.environ.pop(name)
            if value is not None:
                os.environ[name] = value


def run_fresh(function: Callable, *arguments):
    """function(*arguments) in a new Python that has loaded nothing yet. Raises :class:`Failed`."""
    return _run(get_context("spawn"), function, arguments, None)


def run_warm(function: Callable, *arguments, limit: float):
    """The same in a copy of a Python that has loaded the peers' libraries and no more. Raises :class:`TooSlow` after
    `limit` seconds."""
    context = get_context(_WARM)
    if _WARM == "forkserver":
        context.set_forkserver_preload(_LOADED_ONCE)
    return _run(context, function, arguments, limit)


def _run(context, function, arguments, limit):
    receiver, sender = context.Pipe(duplex=False)
    process = context.Process(target=_report, args=(sender, function, arguments), daemon=True)
    process.start()
    sender.close()
    try:
        if not receiver.poll(limit):
            raise TooSlow(f"not done after {limit:.0f} s")
        worked, result = receiver.recv()
    except EOFError:
        process.join()
        raise Failed(f"crashed with exit code {process.exitcode}") from None
    finally:
        process.kill()
        process.join()
        receiver.close()
    if not worked:
        raise Failed(result)
    return result


def _report(sender, function, arguments):
    _end_with_parent()
    try:
        sender.send((True, function(*arguments)))
    except Exception as error:  # noqa: BLE001 - whatever it is, the caller is to hear of it
        sender.send((False, f"{type(error).__name__}: {error}"))


def _end_with_parent():
    """Have this process end when the one that asked for it is gone, unless a library holds the interpreter just then.
    That of a killed run would go on for minutes otherwise, in the way of the next."""

    def watch():
        parent_process().join()
        os.kill(os.getpid(), signal.SIGTERM)

    Thread(target=watch, daemon=True).start()
