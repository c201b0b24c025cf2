"""Fail if a dependency needs a newer Rust than the ``rust-version`` of the workspace.

Cargo says so to users of that Rust alone: on a newer one everything compiles.
"""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]


def numbers(version: str) -> tuple[int, ...]:
    found = tuple(int(part) for part in version.split("."))
    return found + (0,) * (3 - len(found))


def main() -> None:
    command = ["cargo", "metadata", "--format-version=1", "--locked", "--all-features"]
    packages = json.loads(subprocess.run(command, cwd=ROOT, check=True, stdout=subprocess.PIPE).stdout)[
        "packages"
    ]
    (ours,) = {package["rust_version"] for package in packages if not package["source"]}
    rows = [
        f"{package['name']} {package['version']} needs Rust {package['rust_version']}, "
        f"the workspace says {ours}"
        for package in packages
        if package["rust_version"] and numbers(package["rust_version"]) > numbers(ours)
    ]
    if rows:
        sys.exit("\n".join(rows))


main()
