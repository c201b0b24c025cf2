"""What the wheel is."""

from __future__ import annotations

import importlib.metadata
import subprocess
import sys
from pathlib import Path

import pliant


def test_one_wheel_is_for_every_python() -> None:
    assert pliant._pliant.__file__ is not None and pliant._pliant.__file__.endswith((".abi3.so", ".pyd"))
    # What a type checker of a user looks for.
    package = Path(pliant._pliant.__file__).parent
    assert (package / "py.typed").exists() and (package / "_pliant.pyi").exists()


def test_extras_and_the_command_are_named() -> None:
    about = importlib.metadata.metadata("pliant")
    assert {"plot", "mesh", "sparse", "dask"} <= set(about.get_all("Provides-Extra") or [])
    assert about["Requires-Python"] == ">=3.10" and about["Version"] == pliant.__version__
    required = [line for line in importlib.metadata.requires("pliant") or [] if "extra ==" not in line]
    assert len(required) == 1 and required[0].startswith("numpy")
    commands = importlib.metadata.entry_points(group="console_scripts", name="pliant")
    assert [command.value for command in commands] == ["pliant._command:main"]


def test_numpy_is_all_that_an_import_needs() -> None:
    code = "import sys, pliant; print(*{name.split('.')[0] for name in sys.modules})"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, check=True, text=True)
    heavy = {
        "matplotlib",
        "pandas",
        "scipy",
        "meshio",
        "pyvista",
        "dask",
        "distributed",
        "torch",
        "gymnasium",
    }
    assert not heavy & set(done.stdout.split())
