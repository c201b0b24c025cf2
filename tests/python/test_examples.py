"""The examples, and what the README shows."""

from __future__ import annotations

import re
import runpy
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pliant
import pytest
from conftest import ROOT

EXAMPLES = ROOT / "crates" / "py" / "examples"
sys.path.insert(0, str(EXAMPLES))


def test_the_five_lines_of_the_readme(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    blocks = re.findall(r"```python\n(.*?)```", (ROOT / "README.md").read_text(), re.DOTALL)
    five = next(block for block in blocks if "import pliant" in block)
    assert len([line for line in five.splitlines() if line.strip()]) <= 5
    (tmp_path / "scenes").symlink_to(ROOT / "scenes")
    monkeypatch.chdir(tmp_path)
    names: dict[str, object] = {}
    exec(five, names)  # noqa: S102
    assert names["positions"].shape == (121, 80, 2)  # type: ignore[attr-defined]


@pytest.mark.filterwarnings("error")
def test_the_crawler_is_an_environment() -> None:
    pytest.importorskip("gymnasium")
    from gymnasium.utils.env_checker import check_env

    crawler = runpy.run_path(str(EXAMPLES / "crawler.py"))
    check_env(crawler["Crawler"](), skip_render_check=True)
    env = crawler["Crawler"](episode=75)
    env.reset(seed=3)
    rewards, ended = [], False
    while not ended:
        _, reward, _, ended, info = env.step(crawler["wave"](len(rewards)))
        rewards.append(reward)
    assert len(rewards) == 75 and abs(info["time"] - 1.5) < 1e-9
    # It crawls forwards: by a tenth of its length and more, and much more than it slips by doing nothing.
    env.reset(seed=3)
    idle = sum(env.step(np.full(4, -1.0, np.float32))[1] for _ in range(75))
    assert sum(rewards) > 0.03 and sum(rewards) > 5 * abs(idle)


def test_a_dataset_is_the_same_for_the_same_seed() -> None:
    dataset = runpy.run_path(str(EXAMPLES / "dataset.py"))
    one, other = (dataset["generate"](3, seed=5, threads=threads) for threads in (1, 2))
    assert one["positions"].shape == one["velocities"].shape == (3, 26, 52, 2)
    for name, values in one.items():
        np.testing.assert_array_equal(values, other[name])
    np.testing.assert_allclose(one["times"], np.linspace(0.0, 0.5, 26), atol=1e-12)
    simulation = pliant.Simulation(dataset["scene"](float(one["young"][2]), one["gravity"][2].tolist()))
    simulation.run()
    np.testing.assert_array_equal(one["positions"][2, -1], simulation.positions)


def test_a_throw_hits_its_target_by_gradients() -> None:
    throw = runpy.run_path(str(EXAMPLES / "throw.py"))
    hit, misses = throw["aim"](np.array([0.0, 2.0]))
    assert misses[0] > 0.3 and misses[-1] < 1e-9
    # Without any gradient: the rope, thrown so.
    simulation, _ = throw["thrown"](hit)
    simulation.step(throw["STEPS"])
    np.testing.assert_allclose(simulation.positions[-1], throw["TARGET"], atol=1e-9)


def test_constants_of_a_beam_are_found_again_from_its_film() -> None:
    example = runpy.run_path(str(EXAMPLES / "beam_from_film.py"))
    found = example["identify"](example["film"](5e4, 0.35), np.array([7e4, 0.25]))
    np.testing.assert_allclose(found, [5e4, 0.35], rtol=1e-6)


def test_a_bar_has_the_frequencies_that_are_asked_for() -> None:
    example = runpy.run_path(str(EXAMPLES / "tuned_bar.py"))
    shape, history = example["tune"]()
    assert abs(history[0] / example["WANTED"] - 1).max() > 0.1 and len(history) < 12
    # As `modes` has them, which knows nothing of derivatives; and no more steel than before.
    frequencies = pliant.modes(example["scene"](shape), 2)["frequency"]
    np.testing.assert_allclose(frequencies, example["WANTED"], rtol=1e-9)
    weight = [
        pliant.Simulation(example["scene"](of)).masses.sum() for of in (shape, np.full_like(shape, 0.02))
    ]
    assert weight[0] == pytest.approx(weight[1], rel=1e-10)
    assert shape.min() > 0.01 and shape.max() < 0.03


def test_a_crawler_learns_by_gradient_and_learns_less_without() -> None:
    example = runpy.run_path(str(EXAMPLES / "learning_crawler.py"))
    phases, by_gradient = example["learn_by_gradient"](1)
    by_chance = example["learn_by_chance"](1)[1]
    assert len(by_gradient) == len(by_chance) == example["RUNS"] and by_gradient[0] == by_chance[0]
    assert abs(by_gradient[0]) < 0.002
    assert by_gradient[-1] > 0.05 and by_gradient[-1] > by_chance[-1]
    # It crawls: its middle is as far again after as many contractions, and its belly stays near the ground.
    simulation = pliant.Simulation(example["scene"](phases))
    way = [simulation.positions[:, 0].mean()]
    for _ in range(4):
        simulation.step(50)
        way.append(simulation.positions[:, 0].mean())
        assert simulation.positions[:, 1].max() < 3 * example["HEIGHT"]
    parts = np.diff(way)
    assert parts[1:].min() > 0.02 and np.ptp(parts[1:]) < 0.3 * parts[1:].mean()


def pictures(notebook: Any) -> int:
    """Number of outputs that have a picture."""
    outputs = [output for cell in notebook.cells for output in cell.get("outputs", [])]
    return sum("image/png" in output.get("data", {}) for output in outputs)


def test_the_notebook_of_the_lecture_runs() -> None:
    """Its cells assert what they claim."""
    nbclient = pytest.importorskip("nbclient")
    nbformat = pytest.importorskip("nbformat")
    pytest.importorskip("matplotlib")
    notebook = nbformat.read(EXAMPLES / "lecture.ipynb", as_version=4)
    nbclient.NotebookClient(notebook, timeout=120, kernel_name="python3").execute()
    assert pictures(notebook) == 5


def test_the_notebook_of_the_lecture_is_kept_with_its_pictures() -> None:
    nbformat = pytest.importorskip("nbformat")
    path = EXAMPLES / "lecture.ipynb"
    assert pictures(nbformat.read(path, as_version=4)) == 5
    # GitHub does not draw notebooks of some megabytes.
    assert path.stat().st_size < 1_500_000


@pytest.fixture(scope="module")
def finger() -> dict[str, Any]:
    pytest.importorskip("mujoco", reason="the wheel of MuJoCo is not installed")
    return runpy.run_path(str(EXAMPLES / "mujoco_finger.py"))


def test_a_finger_of_a_robot_stands_in_balance(finger: dict[str, Any]) -> None:
    coupled, floor, hand = finger["press"]()
    weight = 9.81 * float(coupled.finger.masses.sum())
    assert floor > 3 * weight
    # The floor carries the finger and what the hand presses with; walls are known to a few parts of a
    # hundred.
    assert abs(floor - (weight - hand)) < 0.05 * floor
    # What the hand does on the finger is what comes into the finger.
    given, got = coupled.work, coupled.finger.energy()["balance.motion"]
    assert abs(given - got) < 0.1 * abs(got)
    np.testing.assert_allclose(coupled.data.time, coupled.finger.time, rtol=1e-9)


def test_what_a_floating_hand_loses_its_finger_gains_but_for_the_delay(finger: dict[str, Any]) -> None:
    lost = [finger["drift"](substeps) for substeps in (20, 10, 5)]
    assert lost[-1] < 0.1
    # In proportion to the interval.
    for long, short in zip(lost, lost[1:]):
        assert 1.6 < long / short < 2.4
