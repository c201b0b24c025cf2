"""Fail if the program and the Python package ask for different features of a dependency.

Cargo would compile that dependency, and everything above it, once for each of them. What only the package
asks for stands in ``crates/features/Cargo.toml``, which is selected with the program.
"""

from __future__ import annotations

import subprocess
import sys
from collections import defaultdict
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
TREE = ["cargo", "tree", "--locked", "--edges", "normal,build", "--prefix", "none", "--no-dedupe"]


def features(*selection: str) -> dict[str, set[str]]:
    """Lists of features by package: one, or two where build scripts ask for others than targets."""
    command = [*TREE, "--format", "{p}|{f}", *selection]
    listed = subprocess.run(command, cwd=ROOT, check=True, capture_output=True, text=True).stdout
    found: dict[str, set[str]] = defaultdict(set)
    for package, _, names in (row.partition("|") for row in listed.splitlines() if row):
        found[" ".join(package.split()[:2])].add(names)
    return found


def main() -> None:
    program = features()
    package = features("-p", "pliant-py", "--features", "pyo3/extension-module")
    rows = [
        f"{name}: {sorted(program[name])} for the program, {sorted(package[name])} for Python"
        for name in sorted(program.keys() & package.keys())
        if program[name] != package[name]
    ]
    if rows:
        sys.exit("\n".join(["features to even out in crates/features/Cargo.toml:", *rows]))


main()
