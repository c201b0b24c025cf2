"""Reports as tables."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path

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
    done = subprocess.run([programs[0], "modes", scene, "--count", "4", "--json"], capture_output=True, check=True)
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
    with pytest.raises(RuntimeError, match="free to move"):
        pliant.modes(beam(), 100)
    with pytest.raises(ValueError, match="different lengths"):
        pliant.Table({"a": [1, 2], "b": [1]})
