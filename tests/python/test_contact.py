"""Contact from Python: contacts as arrays, obstacles that are moved while a simulation runs."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pliant
import pytest
from pliant._pliant import Batch


def block(**more: Any) -> pliant.Scene:
    """A soft block above a floor, and a wall to its right."""
    return pliant.Scene(
        dimension=2,
        time={"integrator": "implicit-euler", "step": 0.01, "duration": 1.0},
        world={"gravity": [0.0, -9.81]},
        contact={"distance": 1e-3, "friction": 0.5},
        body=[
            {
                "name": "block",
                "mesh": {"grid": {"cells": [4, 2], "size": [0.2, 0.1], "origin": [0.0, 0.001]}},
                "elastic": {"neo-hookean": {"young": 1e5, "poisson": 0.3}},
                "mass": {"density": 1000.0},
            }
        ],
        obstacle=[
            {"name": "floor", "shape": {"half_space": {"normal": [0, 1], "offset": 0}}},
            {"name": "pusher", "shape": {"box": {"min": [0.21, 0.0], "max": [0.25, 0.1]}}},
        ],
        **more,
    )


def test_contacts_carry_the_weight() -> None:
    simulation = pliant.Simulation(block())
    assert simulation.contacts()["forces"].shape == (simulation.contacts()["gaps"].size,)
    simulation.step(100)
    found = simulation.contacts()
    on_floor = [pair == ("block", "floor") for pair in found["bodies"]]
    assert all(on_floor) and found["points"].shape == (len(on_floor), 2, 3)
    np.testing.assert_allclose(found["normals"], np.tile([0.0, 1.0, 0.0], (len(on_floor), 1)), atol=1e-12)
    assert found["forces"].sum() == pytest.approx(20.0 * 9.81, rel=2e-3)
    assert np.all(found["gaps"] > 0.0) and np.all(found["gaps"] < 1e-3)
    # The foot of each vertex on the plane, a gap below it.
    heights = found["points"][:, :, 1]
    np.testing.assert_allclose(heights[:, 0] - heights[:, 1], found["gaps"], atol=1e-12)


def test_an_obstacle_is_moved_while_a_simulation_runs() -> None:
    simulation = pliant.Simulation(block())
    simulation.step(20)
    before = simulation.positions[:15, 0].mean()
    simulation.move("pusher/motion", [-0.06, 0.0], over=0.3)
    simulation.step(40)
    after = simulation.positions[:15, 0].mean()
    # Its face goes from 0.21 to 0.15 m; the block, 0.2 m wide, is pushed ahead of it.
    assert before - after == pytest.approx(0.05, abs=0.004)
    assert simulation.reactions()["pusher/motion"].shape == (2, 3)


def test_what_cannot_be_is_told_with_names() -> None:
    scene = block().with_changes({"body.0.mesh.grid.origin": [0.0, -0.05]})
    with pytest.raises(pliant.SceneError, match="`floor`"):
        pliant.Simulation(scene)


def test_positions_in_each_other_are_refused_and_change_nothing() -> None:
    simulation = pliant.Simulation(block())
    before = simulation.positions
    for step in ([0.0, -0.05], [0.03, 0.0]):
        with pytest.raises(ValueError, match="`floor`|`pusher`.*move them apart"):
            simulation.positions = before + [step if i < 15 else [0.0, 0.0] for i in range(len(before))]
        np.testing.assert_array_equal(simulation.positions, before)
    simulation.positions = before + [[0.0, 0.02] if i < 15 else [0.0, 0.0] for i in range(len(before))]
    simulation.step(1)
    batch = Batch(pliant.Simulation(block()), 2, 1)
    # Of the vertices only those of the block: the floor has one, too.
    below = np.stack([before, before + [[0.0, -0.05] if i < 15 else [0.0, 0.0] for i in range(len(before))]])
    with pytest.raises(ValueError, match="`floor`"):
        batch.reset(positions=below)


def test_contacts_are_recorded_frame_by_frame(tmp_path: Path) -> None:
    simulation = pliant.Simulation(block(output={"rate": 100.0, "channels": ["state", "contacts"]}))
    simulation.run(0.1, record=tmp_path / "a.mcap")
    trajectory = pliant.load(tmp_path / "a.mcap")
    now, last = simulation.contacts(), trajectory.contacts()
    assert last["bodies"] == now["bodies"] and len(now["bodies"]) > 0
    for name in ["points", "normals", "gaps", "forces", "friction"]:
        np.testing.assert_array_equal(last[name], now[name])
    assert trajectory.contacts(0)["gaps"].size <= now["gaps"].size
    with pytest.raises(IndexError, match="frame 100 of"):
        trajectory.contacts(100)
    without = block(output={"rate": 100.0, "channels": ["state"]})
    pliant.Simulation(without).run(0.1, record=tmp_path / "b.mcap")
    with pytest.raises(KeyError, match="contacts"):
        pliant.load(tmp_path / "b.mcap").contacts()


def sliding(**more: Any) -> pliant.Simulation:
    """A block that slides over the floor at 1 m/s, once it lies."""
    changes = {
        "body.0.mesh.grid.origin": [0.0, 0.0009],
        "body.0.velocity": {"rigid": {"linear": [1.0, 0.0]}},
        "obstacle.1.shape.box": {"min": [5.0, 0.0], "max": [5.1, 0.1]},
    }
    simulation = pliant.Simulation(block(**more).with_changes(changes))
    simulation.step(3)
    return simulation


def test_friction_of_every_pair_is_mu_times_its_normal_force_and_holds_back() -> None:
    found = sliding().contacts()
    assert found["friction"].shape == (found["gaps"].size, 3)
    np.testing.assert_allclose(found["friction"][:, 0], -0.5 * found["forces"], rtol=1e-12)
    np.testing.assert_allclose(found["friction"][:, 1:], 0.0, atol=1e-12)


def test_friction_changes_while_a_simulation_runs() -> None:
    simulation = sliding()
    simulation.set({"contact.friction": 0.1})
    simulation.step(1)
    found = simulation.contacts()
    np.testing.assert_allclose(found["friction"][:, 0], -0.1 * found["forces"], rtol=1e-12)
    pairs = [{"between": ["block", "floor"], "friction": 0.2}]
    simulation.set({"contact.pairs": pairs})
    simulation.step(1)
    found = simulation.contacts()
    np.testing.assert_allclose(found["friction"][:, 0], -0.2 * found["forces"], rtol=1e-12)


def test_pairs_are_switched_off_and_on_while_a_simulation_runs() -> None:
    simulation = sliding()
    simulation.set({"contact.pairs": [{"between": ["block", "floor"], "contact": False}]})
    simulation.step(10)
    assert not simulation.contacts()["bodies"]
    assert simulation.positions[:15, 1].min() < -0.01
    time = simulation.time
    with pytest.raises(ValueError, match="`floor` overlap by .* now"):
        simulation.set({"contact.pairs": []})
    # Nothing has changed, and the simulation goes on.
    assert simulation.time == time
    simulation.step(1)
    assert not simulation.contacts()["bodies"]
