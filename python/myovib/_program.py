"""The program `myovib`, which the wheel brings too."""

import sys

from . import _native


def main() -> int:
    """Run the program with the arguments of this process."""
    return _native.program(["myovib", *sys.argv[1:]])
