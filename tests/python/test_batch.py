"""Many simulations at once."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
import time
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from pathlib import Path

import numpy as np
import pliant
import pytest
from conftest import beam

YOUNG = "body.0.elastic.corotated.young"


def tip(simulation: pliant.Simulation) -> float:
    return float(simulation.positions[9, 1])


def test_a_rollout_is_each_alone_on_any_number_of_threads() -> None:
    scenes = [beam(**{YOUNG: young}) for young in (5e4, 1e5, 2e5)]
    alone = [pliant.Simulation(scene) for scene in scenes]
    for each in alone:
        each.step(200)
    for threads in (None, 1, 3):
        together = pliant.rollout(scenes, 200, threads=threads)
        assert [each.state for each in together] == [each.state for each in alone]
    view = together[0].positions_view
    further = pliant.rollout(together, 50)
    assert further == together and further[0].steps == 250
    np.testing.assert_array_equal(view, further[0].positions)


def test_a_rollout_goes_on_from_states() -> None:
    simulation = pliant.Simulation(beam())
    simulation.set_material("beam", young=5e4)
    states = []
    for _ in range(3):
        simulation.step(10)
        states.append(simulation.state)
    ahead = pliant.rollout(states, 20, scene=simulation)
    assert simulation.state == states[2] and [each.steps for each in ahead] == [30, 40, 50]
    simulation.step(20)
    assert ahead[2].state == simulation.state and ahead[0].state == states[2]
    stiffer = pliant.rollout(states[:1], 20, scene=beam())
    assert stiffer[0].steps == 30 and stiffer[0].state != ahead[0].state
    with pytest.raises(TypeError, match="`scene=`"):
        pliant.rollout(states, 1)
    with pytest.raises(ValueError, match="state of another scene"):
        pliant.rollout(states, 1, scene=beam(**{"body.0.mesh.grid.cells": [3, 1]}))


def test_a_rollout_says_which_one_failed() -> None:
    good, bad = pliant.Simulation(beam()), pliant.Simulation(beam())
    bad.external_forces = np.full((10, 2), 1e308)
    with pytest.raises(pliant.StepError, match="simulation 1: step ") as caught:
        pliant.rollout([good, bad], 100)
    assert caught.value.step >= 1 and good.steps == 100
    with pytest.raises(ValueError, match="occurs twice"):
        pliant.rollout([good, good], 1)
    with pytest.raises(ValueError, match="threads must be 1 or more"):
        pliant.rollout([good], 1, threads=0)


def test_ctrl_c_ends_a_rollout() -> None:
    timer = threading.Timer(0.3, os.kill, (os.getpid(), signal.SIGINT))
    timer.start()
    with pytest.raises(KeyboardInterrupt):
        pliant.rollout([beam(), beam()], 10**12)
    timer.join()


def test_a_sweep_runs_every_combination(tmp_path: Path) -> None:
    values = {YOUNG: [1e5, "0.2 MPa"], "time.integrator": ["symplectic-euler", "rk4", "bdf2"]}
    outcomes = pliant.sweep(beam(), values, measure=tip, record=tmp_path / "files")
    assert [list(one.parameters.values()) for one in outcomes] == [
        [young, scheme] for young in values[YOUNG] for scheme in values["time.integrator"]
    ]
    for number, one in enumerate(outcomes):
        simulation = pliant.Simulation(beam(**one.parameters))
        simulation.run()
        np.testing.assert_array_equal(one.positions, simulation.positions)
        assert one.error is None and one.energy == simulation.energy() and one.result == tip(simulation)
        recorded = pliant.load(tmp_path / "files" / f"{number:04}.mcap")
        np.testing.assert_array_equal(recorded.positions[-1], simulation.positions)


def test_a_sweep_goes_on_where_one_fails() -> None:
    values = [
        {"time.step": 1e-3},
        {"time.step": 1.0},
        {"time.step": 0.05, "time.allow_unstable": True, "time.duration": 50.0},
    ]
    fine, refused, blown = pliant.sweep(beam(), values)
    assert fine.error is None and fine.steps == 100
    assert isinstance(refused.error, pliant.SceneError) and refused.steps == 0
    assert isinstance(blown.error, pliant.StepError) and 0.0 < blown.time < 50.0


def test_processes_do_it_too_forked_or_not() -> None:
    with ProcessPoolExecutor(2) as executor:
        outcomes = pliant.sweep(beam(), {YOUNG: [1e5, 2e5]}, executor=executor, measure=tip)
    assert [one.result for one in outcomes] == [
        one.result for one in pliant.sweep(beam(), {YOUNG: [1e5, 2e5]}, measure=tip)
    ]


def test_a_cluster_that_loses_a_worker_loses_nothing(tmp_path: Path) -> None:
    """Two worker processes of a real cluster, one killed while it simulates: its tasks are run again."""
    distributed = pytest.importorskip("distributed")
    scene, killed = beam(**{"time.duration": 20.0}), tmp_path / "killed"
    values = {YOUNG: [1e5, 1.2e5, 1.4e5, 1.6e5, 1.8e5, 2e5]}
    expected = pliant.sweep(scene, values)
    options = {
        "n_workers": 2,
        "threads_per_worker": 1,
        "processes": True,
        "dashboard_address": None,
        "host": "127.0.0.1",
    }
    with distributed.LocalCluster(**options) as cluster, distributed.Client(cluster) as client:
        client.wait_for_workers(2, timeout=60)
        pids = client.run(os.getpid)
        kill = threading.Thread(target=kill_when_busy, args=(client, pids, killed))
        kill.start()
        outcomes = pliant.sweep(
            scene, values, executor=client.get_executor(), measure=partial(worker, killed)
        )
        kill.join()
    assert [one.error for one in outcomes] == [None] * 6
    for one, other in zip(outcomes, expected):
        assert one.parameters == other.parameters and one.positions.tobytes() == other.positions.tobytes()
    # Another worker has done what the killed one was doing.
    victim = next(iter(pids.values()))
    assert killed.exists() and victim not in {one.result for one in outcomes} and not alive(victim)


def worker(killed: Path, simulation: pliant.Simulation) -> int:
    """Ends no task before one of the workers has been killed: that one was at work on any machine."""
    for _ in range(3000):
        if killed.exists():
            return os.getpid()
        time.sleep(0.02)
    raise TimeoutError("nobody was killed")


def kill_when_busy(client: object, pids: dict[str, int], killed: Path) -> None:
    address = next(iter(pids))
    for _ in range(600):
        if client.processing().get(address):  # type: ignore[attr-defined]
            time.sleep(0.05)
            os.kill(pids[address], signal.SIGKILL)
            killed.touch()
            return
        time.sleep(0.02)


def alive(pid: int) -> bool:
    stat = Path(f"/proc/{pid}/stat")
    return stat.exists() and stat.read_text().rsplit(")", 1)[1].split()[0] != "Z"


def test_what_a_sweep_says_pickles() -> None:
    code = (
        "import pickle, sys, pliant; print(pickle.loads(sys.stdin.buffer.read()).error.problems[0]['path'])"
    )
    import pickle

    refused = pliant.sweep(beam(), {"time.step": [1.0]})[0]
    done = subprocess.run(
        [sys.executable, "-c", code], input=pickle.dumps(refused), capture_output=True, check=True
    )
    problem = refused.error.problems[0]  # type: ignore[union-attr]
    assert done.stdout.decode().strip() == problem["path"] == "time.step"
