"""The command-line program `myovib`, which is part of the wheel."""

import signal
import sys

from . import _native


def main() -> int:
    """Run the program with the arguments of this process."""
    # Python's handler would run only after the program has ended.
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        signal.signal(signal.SIGINT, signal.SIG_DFL)
    return _native.program(["myovib", *sys.argv[1:]])
