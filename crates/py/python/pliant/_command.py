"""The command ``pliant``: the same program as that of ``cargo install``."""

from __future__ import annotations

import signal
import sys

from ._pliant import _command


def main() -> int:
    """Run the command line; returns the exit code."""
    # Commands that do not simulate end at Ctrl-C like any program; those that do install a handler of their own.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    return _command(["pliant", *sys.argv[1:]])
