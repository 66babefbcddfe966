"""The command ``graspmoduli``; beside the package, not in it, so as to start before its imports.

Until all is imported, there is nothing to put in order: a signal ends the process at once.
"""

import os
import signal
from types import FrameType

#: What a signal means, in a word.
WORDS = {"SIGINT": "interrupted", "SIGTERM": "terminated", "SIGHUP": "hung up"}


def main() -> None:
    """Entry point."""
    for name in WORDS:
        number = getattr(signal, name, None)
        # What is ignored stays so: nohup.
        if number is not None and signal.getsignal(number) is not signal.SIG_IGN:
            signal.signal(number, _end)
    from graspmoduli.cli import main

    main()


def _end(number: int, _frame: FrameType | None) -> None:
    try:
        os.write(2, f"graspmoduli: {WORDS[signal.Signals(number).name]}\n".encode())
    finally:
        os._exit(128 + number)
