"""Simulations that go on in another process, with the same bits."""

from __future__ import annotations

import copy
import pickle
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pliant
import pytest
from conftest import beam

SCHEMES: list[Any] = ["symplectic-euler", "implicit-euler", "bdf2", "generalised-alpha", "sdirk3"]


def same(a: pliant.Simulation, b: pliant.Simulation) -> bool:
    return a.state == b.state and a.energy() == b.energy() and a.pins == b.pins


def changed(scheme: Any) -> pliant.Simulation:
    simulation = pliant.Simulation(beam(**{"time.integrator": scheme, "world.ether_drag": 0.1}))
    simulation.step(10)
    simulation.set_material("beam", young=5e4)
    simulation.external_forces = np.full((10, 2), 0.5)
    simulation.pin([9], name="hand")
    simulation.release("beam/left")
    simulation.step(10)
    return simulation


@pytest.mark.parametrize("scheme", SCHEMES)
def test_what_is_saved_goes_on_with_the_same_bits(scheme: Any, tmp_path: Path) -> None:
    simulation, path = changed(scheme), tmp_path / "moment.checkpoint"
    simulation.save(path)
    other = pliant.Simulation.restore(path)
    assert other.steps == 20 and other.pins == ["hand"] and same(simulation, other)
    simulation.step(10)
    other.step(10)
    assert same(simulation, other)
    # The state alone is the same to the tolerance of the solver.
    other.reset()
    assert other.time == 0.0
    # And it is replaced.
    simulation.save(path)
    assert same(pliant.Simulation.restore(path), simulation)
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize("scheme", SCHEMES)
@pytest.mark.parametrize(
    "duplicate",
    [
        lambda simulation: simulation.clone(),
        copy.copy,
        lambda simulation: pickle.loads(pickle.dumps(simulation)),
    ],
)
def test_duplicates_go_on_with_the_same_bits(duplicate: Any, scheme: Any) -> None:
    simulation = changed(scheme)
    other = duplicate(simulation)
    simulation.step(10)
    other.step(10)
    assert same(simulation, other)


def test_another_process_goes_on_with_the_same_bits(tmp_path: Path) -> None:
    simulation, path = changed("implicit-euler"), tmp_path / "moment.checkpoint"
    simulation.save(path)
    code = f"import pliant; s = pliant.Simulation.restore({str(path)!r}); s.step(10); s.save({str(path)!r})"
    subprocess.run([sys.executable, "-c", code], check=True)
    simulation.step(10)
    other = pliant.Simulation.restore(path)
    assert other.steps == 30
    np.testing.assert_array_equal(other.positions, simulation.positions)
    np.testing.assert_array_equal(other.velocities, simulation.velocities)


def double(time: float, positions: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
    return 2.0 * positions


def test_functions_are_saved_by_their_names(tmp_path: Path) -> None:
    simulation, path = pliant.Simulation(beam()), tmp_path / "moment.checkpoint"
    simulation.external_forces = double
    simulation.step(5)
    simulation.save(path)
    other = pliant.Simulation.restore(path)
    assert other.external_forces is double
    simulation.step(5)
    other.step(5)
    assert same(simulation, other)
    simulation.external_forces = lambda time, positions: positions
    with pytest.raises((pickle.PicklingError, AttributeError)):
        simulation.save(path)


def test_a_checkpoint_of_the_command_line_is_restored(tmp_path: Path, programs: list[str]) -> None:
    (tmp_path / "beam.toml").write_text(beam(**{"time.integrator": "implicit-euler"}).text)
    run = [programs[0], "run", "beam.toml", "--until", "0.1", "--checkpoint", "1e-9", "-q"]
    subprocess.run(run, cwd=tmp_path, check=True)
    simulation = pliant.Simulation.restore(tmp_path / "beam.checkpoint")
    # The last step of the run after which its solver begins anew.
    assert simulation.steps == 64 and simulation.scene.name.endswith("beam.toml")
    simulation.save(tmp_path / "beam.checkpoint")
    done = subprocess.run(
        [programs[0], "resume", "beam.checkpoint"], cwd=tmp_path, capture_output=True, text=True
    )
    assert done.returncode == 2 and "is a simulation that Python has saved" in done.stderr


def test_what_is_broken_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "moment.checkpoint"
    with pytest.raises(FileNotFoundError, match="moment.checkpoint"):
        pliant.Simulation.restore(path)
    pliant.Simulation(beam()).save(path)
    whole = path.read_bytes()
    flipped = whole[:200] + bytes([whole[200] ^ 1]) + whole[201:]
    for bytes_, said in [(whole[:-1], "damaged"), (b"[time]", "is not a checkpoint"), (flipped, "damaged")]:
        path.write_bytes(bytes_)
        with pytest.raises(ValueError, match=said):
            pliant.Simulation.restore(path)
    with pytest.raises(OSError, match="directory"):
        pliant.Simulation(beam()).save(tmp_path)
