"""Ctrl-C and SIGTERM end a command within a second or two, whatever it is doing."""

from __future__ import annotations

import contextlib
import os
import signal
import socket
import sys
import threading
from types import FrameType

from _graspmoduli_command import WORDS

from ._files import discard_unfinished

#: A command that has not ended by itself after this many seconds is ended.
GRACE = 1.0

_told = threading.Event()


class Terminated(BaseException):
    """A signal to end, other than Ctrl-C; carries its number."""

    def __init__(self, number: int) -> None:
        super().__init__(number)
        self.number = number


def heed() -> None:
    """From now on: an exception in the main thread, and the end of the process if that is not seen.

    Python's own handlers wait until the main thread is back from compiled code. A byte in a socket
    is there at once, and a thread waits for it.
    """
    for name in WORDS:
        number = getattr(signal, name, None)
        # What is ignored stays so: nohup.
        if number is not None and signal.getsignal(number) is not signal.SIG_IGN:
            signal.signal(number, signal.default_int_handler if name == "SIGINT" else _raise)
    reader, writer = socket.socketpair()
    writer.setblocking(False)
    signal.set_wakeup_fd(writer.fileno(), warn_on_full_buffer=False)
    watch = threading.Thread(target=_watch, args=(reader, writer), daemon=True, name="signals")
    watch.start()


def code(number: int) -> int:
    """The exit code of a process that a signal ended; says so, once, on standard error."""
    if not _told.is_set():
        _told.set()
        say(WORDS.get(signal.Signals(number).name, "ended"))
    return 128 + number


def say(message: str) -> None:
    """One line on standard error, if that takes it."""
    with contextlib.suppress(OSError, ValueError):
        print(f"graspmoduli: {message}", file=sys.stderr, flush=True)


def _raise(number: int, _frame: FrameType | None) -> None:
    raise Terminated(number)


def _watch(reader: socket.socket, _writer: socket.socket) -> None:
    while True:
        number = reader.recv(1)[0]
        if number in [getattr(signal, name, 0) for name in WORDS]:
            # The main thread may see to it in good order.
            threading.Event().wait(GRACE)
            discard_unfinished()
            os._exit(code(number))
