"""What several tests need."""

from __future__ import annotations

import os
import shutil
import signal
import sys
from pathlib import Path
from typing import Any

import pliant
import pytest

ROOT = Path(__file__).resolve().parents[2]
SCENES = ROOT / "scenes"

# What a shell starts in the background ignores it, and tests that interrupt runs would not end.
signal.signal(signal.SIGINT, signal.default_int_handler)


def beam(**changes: Any) -> pliant.Scene:
    """A soft beam of 4 x 1 cells, pinned at its left, under gravity, with values changed."""
    scene = pliant.Scene(
        dimension=2,
        time={"integrator": "symplectic-euler", "step": 1e-3, "duration": 0.1},
        world={"gravity": [0.0, -9.8]},
        body=[
            {
                "name": "beam",
                "mesh": {"grid": {"cells": [4, 1], "spacing": 0.1}},
                "elastic": {"corotated": {"young": 1e5, "poisson": 0.3}},
                "mass": {"density": 1000.0},
                "pin": [{"name": "left", "vertices": [0, 1]}],
            }
        ],
    )
    return scene.with_changes(changes) if changes else scene


@pytest.fixture
def simulation() -> pliant.Simulation:
    return pliant.Simulation(beam())


@pytest.fixture(scope="session")
def programs() -> list[str]:
    """The command that the wheel installed, and that of cargo where `PLIANT` names it."""
    installed = shutil.which("pliant", path=str(Path(sys.executable).parent))
    assert installed, "the wheel installs a command"
    return [installed, *filter(None, [os.environ.get("PLIANT")])]
