"""Vibration: modes, what they add up to, how a blow sounds."""

from __future__ import annotations

import json
import subprocess
import wave
from pathlib import Path
from typing import Any

import numpy as np
import pliant
import pytest
from conftest import SCENES, beam


def test_modes_are_those_of_the_matrices(simulation: pliant.Simulation) -> None:
    found = pliant.modes(simulation, 5)
    k, m = simulation.stiffness().toarray(), simulation.mass().toarray()
    free = np.arange(4, 20)
    omega2 = np.sort(np.linalg.eigvals(np.linalg.solve(m[np.ix_(free, free)], k[np.ix_(free, free)])).real)
    np.testing.assert_allclose(found["omega"] ** 2, omega2[:5], rtol=1e-8)
    np.testing.assert_allclose(found["frequency"], found["omega"] / (2 * np.pi), rtol=1e-12)
    shapes = found["shape"].reshape(5, 20)
    np.testing.assert_allclose(shapes @ m @ shapes.T, np.eye(5), atol=1e-8)
    assert found.rows == 5 and found.free_coordinates == 16
    assert "frequency [Hz]" in repr(found) and len(repr(found).splitlines()) == 6


def test_modes_are_those_of_the_command_line(programs: list[str]) -> None:
    scene = SCENES / "beam_3d.toml"
    done = subprocess.run(
        [programs[0], "modes", scene, "--count", "4", "--json"], capture_output=True, check=True
    )
    theirs = [mode["frequency"] for mode in json.loads(done.stdout)["modes"]["modes"]]
    ours = pliant.modes(pliant.Scene.from_toml(scene), 4)
    assert ours["frequency"].tolist() == theirs


def test_tables_go_to_pandas_and_matplotlib(tmp_path: Path) -> None:
    pytest.importorskip("pandas")
    matplotlib = pytest.importorskip("matplotlib")
    matplotlib.use("agg")
    found = pliant.modes(beam(), 3)
    table = found.to_pandas()
    assert table.shape == (3, 5) and table["frequency"].is_monotonic_increasing
    axes = found.plot(1)
    rest, moved = (line.get_xydata() for line in axes.lines)
    np.testing.assert_array_equal(rest, found.rest)
    # The largest displacement is a tenth of the size, along the shape.
    shape = found["shape"][1]
    assert abs(np.abs(moved - rest).max() - 0.04) < 1e-12
    np.testing.assert_allclose((moved - rest) / 0.04, shape / np.abs(shape).max(), atol=1e-9)
    axes.figure.savefig(tmp_path / "mode.png")


def test_what_cannot_vibrate_is_said() -> None:
    with pytest.raises(RuntimeError, match="16 unknowns"):
        pliant.modes(beam(), 100)
    with pytest.raises(ValueError, match="different lengths"):
        pliant.Table({"a": [1, 2], "b": [1]})


# lecture 2: the exact motion of a linear system.
def test_superposition_is_what_steps_converge_to() -> None:
    linear = {"body.0.elastic": {"linear": {"young": 1e5, "poisson": 0.3}}, "time.integrator": "yoshida4"}
    simulation = pliant.Simulation(beam(**linear, **{"time.step": 2.5e-4}))
    exact = simulation.superposition()
    assert exact.nonlinearity < 1e-8 and exact.residual["elastic"] == 0.0
    x, v = exact.at(0.0)
    np.testing.assert_array_equal(x, simulation.positions)
    simulation.step(400)
    x, v = exact.at(0.1)
    moved = np.abs(x - simulation.rest_positions).max()
    # Order 4: five digits beside what has moved.
    np.testing.assert_allclose(simulation.positions, x, atol=1e-5 * moved)
    np.testing.assert_allclose(simulation.velocities, v, atol=1e-4 * np.abs(v).max())
    k, m = simulation.stiffness().toarray()[4:, 4:], simulation.mass().toarray()[4:, 4:]
    np.testing.assert_allclose(
        exact.omega**2, np.linalg.eigvalsh(k / np.sqrt(np.outer(m.diagonal(), m.diagonal()))), rtol=1e-8
    )
    shapes = exact.shapes.reshape(16, 20)
    np.testing.assert_allclose(shapes @ simulation.mass().toarray() @ shapes.T, np.eye(16), atol=1e-8)
    few = pliant.Simulation(beam(**linear)).superposition(3)
    assert len(few.omega) == 3 and 0.0 < few.residual["elastic"] < few.residual["elastic_total"]
    for wrong in (-1.0, float("nan")):
        with pytest.raises(ValueError, match="0 or more"):
            exact.at(wrong)
    walls = {"world.walls": [{"normal": [0.0, 1.0], "offset": -1.0}]}
    with pytest.raises(ValueError, match="walls push"):
        pliant.Simulation(beam(**linear, **walls)).superposition()


@pytest.mark.parametrize("bits", [16, 24])
def test_a_sound_is_that_of_the_command_line(bits: Any, programs: list[str], tmp_path: Path) -> None:
    (tmp_path / "scene.toml").write_text(beam().to_toml())
    options = [
        "--count",
        "5",
        "--strike",
        "9",
        "--direction",
        "0,1",
        "--listen",
        "4",
        "--rayleigh",
        "1,1e-4",
        "--bits",
        str(bits),
    ]
    command = [
        programs[0],
        "modes",
        tmp_path / "scene.toml",
        "--sound",
        tmp_path / "theirs.wav",
        *options,
        "--seconds",
        "0.5",
        "--json",
    ]
    theirs = json.loads(subprocess.run(command, capture_output=True, check=True).stdout)["sound"]
    heard = pliant.sound(beam(), 9, [0.0, 1.0], listen=4, count=5, rayleigh=(1.0, 1e-4), seconds=0.5)
    for name in heard:
        assert heard[name].tolist() == [tone[name] for tone in theirs["partials"]]
    assert heard.silent == theirs["silent"] and heard.samples.shape == (24_000,)
    heard.write(tmp_path / "ours.wav", bits=bits)
    ours, theirs = ((tmp_path / f"{name}.wav").read_bytes() for name in ("ours", "theirs"))
    # Headers of 24 bits differ, and the module wave reads only one of them.
    assert ours[-bits // 8 * 24_000 :] == theirs[-bits // 8 * 24_000 :] != bytes(bits // 8 * 24_000)
    with wave.open(str(tmp_path / "ours.wav")) as file:
        assert (file.getnchannels(), file.getsampwidth(), file.getframerate(), file.getnframes()) == (
            1,
            bits // 8,
            48_000,
            24_000,
        )


def test_what_makes_no_sound_is_said() -> None:
    with pytest.raises(ValueError, match="vertex 0 is pinned"):
        pliant.sound(beam(), 0, [1.0, 0.0])
    with pytest.raises(ValueError, match="no vertex 10"):
        pliant.sound(beam(), 10, [1.0, 0.0])
    with pytest.raises(ValueError, match="3 components"):
        pliant.sound(beam(), 9, [1.0, 0.0, 0.0])
    with pytest.raises(ValueError, match="seconds must be"):
        pliant.sound(beam(), 9, [1.0, 0.0], seconds=-1.0)
    with pytest.raises(RuntimeError, match="nothing is heard"):
        pliant.sound(beam(), 9, [1.0, 0.0], count=5, rate=2)
