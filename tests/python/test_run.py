"""Whole runs: the same bits as the command line, and how they end."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import threading
import warnings
from pathlib import Path

import numpy as np
import pliant
import pytest
from conftest import ROOT, SCENES, beam


@pytest.mark.parametrize(
    "name", ["cantilever_fem_2d", "cloth_implicit", "twisted_bar", "settling_beam_2d", "comet"]
)
def test_a_run_writes_the_file_of_the_command_line(name: str, programs: list[str], tmp_path: Path) -> None:
    scene = SCENES / f"{name}.toml"
    simulation = pliant.Simulation(pliant.Scene.from_toml(scene).with_changes({"time.duration": 0.1}))
    with warnings.catch_warnings(record=True) as issued:
        warnings.simplefilter("always")
        summary = simulation.run(record=tmp_path / "python.mcap")
    assert [str(warning.message) for warning in issued] == summary.warnings
    # One loses energy by its scheme, the others bend few elements or are nearly incompressible.
    warned = {"cloth_implicit", "cantilever_fem_2d", "twisted_bar", "settling_beam_2d"}
    assert len(issued) == (1 if name in warned else 0)
    ours = (tmp_path / "python.mcap").read_bytes()
    for number, program in enumerate(programs):
        out = tmp_path / f"{number}.mcap"
        command = [program, "run", scene, "-o", out, "--set", "time.duration=0.1", "--json"]
        done = subprocess.run(command, cwd=ROOT, capture_output=True, check=True, text=True)
        assert out.read_bytes() == ours, program
        assert json.loads(done.stdout)["status"] == "done"
    assert summary.frames == len(pliant.load(tmp_path / "python.mcap")) and str(summary.path) == str(
        tmp_path / "python.mcap"
    )


def test_steps_are_those_of_a_run() -> None:
    running, stepping = pliant.Simulation(beam()), pliant.Simulation(beam())
    summary = running.run()
    stepping.step(summary.steps)
    assert running.state.positions.tobytes() == stepping.state.positions.tobytes()
    assert (summary.steps, running.steps) == (100, 100)
    assert summary.end == running.energy() and summary.start["kinetic"] == 0.0
    assert summary.path is None and 0.0 < summary.energy_drift <= summary.energy_error < 0.1


def test_losses_are_known_after_a_run_that_nobody_watches(tmp_path: Path) -> None:
    scene = pliant.Scene.from_toml(SCENES / "damped_jelly.toml")
    simulation = pliant.Simulation(scene)
    simulation.run(0.1)
    balance = {name: energy for name, energy in simulation.energy().items() if name.startswith("balance.")}
    stepping = pliant.Simulation(scene)
    stepping.step(simulation.steps)
    assert balance["balance.damping"] > 0.0 and simulation.energy() == pytest.approx(stepping.energy())
    # What is lost from here on is no drift.
    assert simulation.run(0.2, record=tmp_path / "on.mcap").energy_drift < 1e-2
    simulation.velocities = 2.0 * simulation.velocities
    assert simulation.run(0.3, record=tmp_path / "changed.mcap").energy_drift < 1e-2
    assert 0.0 < simulation.energy()["balance.damping"] != balance["balance.damping"]


def test_walls_are_among_the_reactions() -> None:
    scene = pliant.Scene.from_toml(SCENES / "pavilion.toml").with_changes({"time.duration": 0.1})
    simulation = pliant.Simulation(scene)
    simulation.run()
    reactions = simulation.reactions()
    assert reactions["wall0"].shape == (2, 3) and reactions["wall0"][0, 2] >= 0.0


def test_frames_are_shown_at_their_rate(simulation: pliant.Simulation) -> None:
    frames: list[pliant.Frame] = []
    simulation.run(until=0.05, callback=frames.append)
    assert [frame.index for frame in frames] == list(range(len(frames))) and len(frames) == 4
    np.testing.assert_allclose([frame.time for frame in frames], [0.0, 0.017, 0.033, 0.05])
    np.testing.assert_array_equal(frames[-1].positions, simulation.positions)
    np.testing.assert_array_equal(frames[-1].velocities, simulation.velocities)
    assert frames[-1].energy == simulation.energy()
    # From here on.
    simulation.run(until=0.1, callback=frames.append)
    assert frames[4].time == frames[3].time and simulation.steps == 100


def test_what_a_callback_raises_ends_the_run_and_the_file(
    simulation: pliant.Simulation, tmp_path: Path
) -> None:
    def third(frame: pliant.Frame) -> None:
        if frame.index == 2:
            raise LookupError("enough")

    path = tmp_path / "out.mcap"
    with pytest.raises(LookupError, match="enough"):
        simulation.run(callback=third, record=path)
    assert pliant._pliant.Recording(path).times.size == 3
    with pytest.raises(FileExistsError, match="overwrite=True"):
        simulation.run(record=path)
    simulation.run(record=path, overwrite=True)
    with pytest.raises(ValueError, match="ends at 0.01 s, and the simulation is at 0.1 s"):
        simulation.run(until=0.01)
    with pytest.raises(OSError, match="cannot write"):
        simulation.run(until=1.0, record=tmp_path / "absent" / "out.mcap")


def test_a_run_that_blows_up_keeps_its_frames(tmp_path: Path) -> None:
    scene = beam(**{"time.step": 0.02, "time.duration": 5.0, "time.allow_unstable": True})
    simulation = pliant.Simulation(scene)
    with pytest.raises(pliant.StepError) as caught:
        simulation.run(record=tmp_path / "out.mcap")
    assert caught.value.stable_step is not None and caught.value.stable_step < 0.02
    assert caught.value.step > 0
    recording = pliant._pliant.Recording(tmp_path / "out.mcap")
    assert recording.info()["outcome"]["status"] == "failed"
    # Of the state that was no good one, there is no frame: the last is that of the step before.
    assert 0.0 <= simulation.time - recording.times[-1] < 1.001 * 0.02


def test_a_quasi_static_run_ends_with_its_equilibrium() -> None:
    time = {"time.integrator": "quasi-static", "time.step": 0.5, "time.duration": 1.0}
    scene = beam(**time, **{"world.gravity": [0.0, "-0.98 * t"]})
    summary = pliant.Simulation(scene).run()
    assert summary.energy_drift is None and summary.energy_error is None
    assert summary.statics is not None
    weight = pliant.Simulation(scene).masses.sum() * 0.98
    np.testing.assert_allclose(summary.statics["reactions"], [0.0, weight, 0.0], atol=1e-4 * weight)
    assert summary.statics["residual"] < 1e-4 * weight
    assert (
        summary.statics["displacement"]["body"] == "beam" and summary.statics["displacement"]["value"] > 1e-5
    )
    assert summary.statics["von_mises"]["value"] > 100.0
    assert pliant.Simulation(beam()).run().statics is None


@pytest.mark.parametrize("call", ["step", "run"])
def test_ctrl_c_stops_between_steps(call: str, tmp_path: Path) -> None:
    simulation = pliant.Simulation(beam(**{"time.duration": 1e6}))
    timer = threading.Timer(0.3, os.kill, (os.getpid(), signal.SIGINT))
    timer.start()
    path = tmp_path / "out.mcap"
    with pytest.raises(KeyboardInterrupt):
        if call == "step":
            simulation.step(10**12)
        else:
            simulation.run(record=path)
    timer.join()
    steps = simulation.steps
    assert steps > 0
    simulation.step()
    assert simulation.steps == steps + 1
    if call == "run":
        assert pliant._pliant.Recording(path).info()["outcome"]["status"] == "interrupted"


def test_progress_goes_to_standard_error(
    simulation: pliant.Simulation, capsys: pytest.CaptureFixture[str]
) -> None:
    simulation.run(progress=True)
    out, err = capsys.readouterr()
    assert out == "" and "t = " in err and "s left" in err


def test_the_command_has_the_exit_codes_of_the_program(programs: list[str], tmp_path: Path) -> None:
    for program in programs:
        run = lambda *arguments: subprocess.run(  # noqa: E731
            [program, *map(str, arguments)], cwd=tmp_path, capture_output=True, text=True
        )
        assert run("--version").stdout.split() == ["pliant", pliant.__version__]
        wrong = run("run", "absent.toml")
        assert wrong.returncode == 2 and "absent.toml" in wrong.stderr
        assert run("rum").returncode == 2
        scene = SCENES / "cantilever_fem_2d.toml"
        long = [program, "run", str(scene), "--until", "1000", "-o", str(tmp_path / "long.mcap"), "--force"]
        process = subprocess.Popen(long, stderr=subprocess.PIPE)
        part = tmp_path / "long.mcap.part"
        while not (part.exists() and part.stat().st_size > 10_000):
            assert process.poll() is None
        process.send_signal(signal.SIGINT)
        _, stderr = process.communicate(timeout=60)
        assert process.returncode == 130 and b"interrupted" in stderr
        assert pliant._pliant.Recording(tmp_path / "long.mcap").info()["outcome"]["status"] == "interrupted"


def test_the_child_of_a_fork_can_step() -> None:
    code = """
import os, sys, pliant
scene = pliant.Scene.from_toml(sys.argv[1])
simulation = pliant.Simulation(scene)
simulation.step(3)
child = os.fork()
if child == 0:
    simulation.step(3)
    os._exit(0 if simulation.steps == 6 else 1)
raise SystemExit(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]))
"""
    # Large enough for several threads.
    scene = SCENES / "galaxy.toml"
    subprocess.run([sys.executable, "-c", code, str(scene)], timeout=120, check=True)
