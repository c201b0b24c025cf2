"""The command ``pliant``: the same program as that of ``cargo install``."""

from __future__ import annotations

import json
import signal
import subprocess
import sys

from ._pliant import _command


def main() -> int:
    """Run the command line; returns the exit code."""
    # Commands that do not simulate end at Ctrl-C like any program; those that do install a handler of their
    # own.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    return _command(["pliant", *sys.argv[1:]])


def run_command(*arguments: str) -> None:
    """Do what a command line asks for in a process of its own, whose output is not shown.

    Raises
    ------
    ValueError
        The command line is a mistake: what the program says of it.
    RuntimeError
        It cannot be done.
    """
    program = "from pliant._command import main; raise SystemExit(main())"
    ended = subprocess.run(
        [sys.executable, "-c", program, *arguments, "--json"], capture_output=True, text=True, check=False
    )
    if ended.returncode == 0:
        return
    try:
        message = "; ".join(problem["message"] for problem in json.loads(ended.stdout)["problems"])
    except (ValueError, KeyError, TypeError):
        message = ended.stderr.strip() or f"it ended with {ended.returncode}"
    raise (ValueError if ended.returncode == 2 else RuntimeError)(message)
