"""Run all comparisons whose programs are installed: ``run.py [NAME...]``, as ``run.py rebound felupe``.

Each runs in a process of its own, one after the other. Prints Markdown.
"""

from __future__ import annotations

import importlib.util
import os
import platform
import subprocess
import sys
from pathlib import Path

import pliant
from common import ROUNDS, processor

NAMES = ("rebound", "felupe", "mujoco", "newton", "taichi")


def main() -> None:
    names = sys.argv[1:] or NAMES
    unknown = [name for name in names if name not in NAMES]
    if unknown:
        raise SystemExit(f"there is {', '.join(NAMES)}, and no {unknown[0]}")
    rounds = os.environ.get("PEERS_ROUNDS", ROUNDS)
    print(f"{processor()}, {os.cpu_count()} cores, 1 thread; Python {platform.python_version()};")
    print(f"pliant {pliant.__version__}; medians of {rounds} rounds.", flush=True)
    failed = False
    for name in names:
        if importlib.util.find_spec(name) is None:
            print(f"\n## Beside {name}\n\nnot installed: left out", flush=True)
            continue
        script = Path(__file__).with_name(f"with_{name}.py")
        failed |= subprocess.run([sys.executable, script], check=False).returncode != 0
    sys.exit(failed)


if __name__ == "__main__":
    main()
