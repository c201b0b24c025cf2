"""Studies, the torture suite and surveys of steps: what the command line reports, as tables."""

from __future__ import annotations

import csv
import json
import os
import signal
import subprocess
import threading
import time
from pathlib import Path
from typing import Any

import numpy as np
import pliant
import pytest
from conftest import SCENES, beam

CHAIN = SCENES / "study" / "chain.toml"
#: What depends on the machine's mood.
TIMES = {"wall_min_s", "wall_median_s", "wall_iqr_s", "setup_s", "peak_rss_mb"}


def cell(value: Any) -> str:
    """A cell of a table as comma-separated values have it."""
    if isinstance(value, bool):
        return str(value).lower()
    return "" if value != value else str(value)


def same(text: str, value: Any) -> bool:
    """Whether a cell of a file is this value."""
    try:
        return float(text) == float(value)
    except ValueError:
        return text == cell(value)


def test_a_study_is_that_of_the_command_line(programs: list[str], tmp_path: Path) -> None:
    steps, young = [0.02, 0.01], "body.0.springs.stiffness"
    found = pliant.study(
        pliant.Scene.from_toml(CHAIN),
        integrators=["velocity-verlet", {"newmark": {"beta": 0.25, "gamma": 0.5}}],
        steps=steps,
        tolerances=[],
        vary={young: [100.0, 200.0]},
        repeats=1,
        report=tmp_path / "report.html",
    )
    names = "velocity-verlet,{ newmark = { beta = 0.25, gamma = 0.5 } }"
    command = [
        programs[0],
        "study",
        CHAIN,
        "--integrators",
        names,
        "--steps",
        "0.02,0.01",
        "--vary",
        f"{young}=100.0,200.0",
    ]
    command += ["--set", "study.tolerances=[]", "--repeats", "1", "-o", tmp_path / "out", "--json"]
    theirs = json.loads(subprocess.run(command, capture_output=True, check=True).stdout)["studies"][0]
    with open(tmp_path / "out" / "rows.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    assert list(found) == list(rows[0]) and found.rows == len(rows) == 8
    for name in set(found) - TIMES:
        for text, value in zip([row[name] for row in rows], found[name].tolist()):
            assert same(text, value), (name, text, value)
    for name in ("lines", "references"):
        ours: Any = found.references if name == "references" else found.lines
        for variant, there in enumerate(theirs["variants"]):
            if name == "references":
                assert ours[variant] == {"variant": there["variant"], **there["reference"]}
            else:
                mine = {column: ours[column][ours["variant"] == there["variant"]].tolist() for column in ours}
                assert mine["order_observed"] == [line["order_observed"] for line in there["lines"]]
                assert mine["stop"] == ["steps", "steps"]
    record = theirs["variants"][0]["rows"][1]
    assert found.errors(1)["q_rms"].tolist() == [error["q_rms"] for error in record["errors"]]
    assert found.energy(1)["energy"].tolist() == record["energy"]
    assert max(found.errors(1)["time"]) == 1.0 and found.units["dt"] == "s"
    page = (tmp_path / "report.html").read_text()
    assert page.startswith("<!doctype html>") and page.count("<svg") >= 2 * 4


# verification E: observed orders, and a reference that is exact.
def test_a_study_sees_the_order_of_a_scheme() -> None:
    found = pliant.study(
        pliant.Scene.from_toml(CHAIN),
        integrators=["velocity-verlet"],
        steps=[2.5e-3, 1.25e-3],
        tolerances=[],
        repeats=1,
    )
    assert found.references[0]["how"].startswith("exact") and abs(found["obs_order"][1] - 2.0) < 0.05
    np.testing.assert_allclose(found.lines["order_observed"], found["obs_order"][1:], rtol=1e-12)
    assert 'integrator = "velocity-verlet"' in found.recommendation and found.front.rows >= 1
    assert "order_observed" in repr(found.lines) and "wall_min_s [s]" in repr(found)


def test_a_study_goes_on_from_its_folder(tmp_path: Path) -> None:
    options: dict[str, Any] = {
        "integrators": ["velocity-verlet"],
        "steps": [0.02, 0.01],
        "tolerances": [],
        "repeats": 1,
        "folder": tmp_path,
    }
    rows: list[dict[str, Any]] = []

    def enough(row: dict[str, Any]) -> None:
        rows.append(row)
        raise LookupError("enough")

    scene = pliant.Scene.from_toml(CHAIN)
    with pytest.raises(LookupError, match="enough"):
        pliant.study(scene, **options, callback=enough)
    assert len(rows) == 1 and len((tmp_path / "journal.jsonl").read_text().splitlines()) == 1
    found = pliant.study(scene, **options, callback=rows.append)
    # The first row is that of the first attempt, its time included.
    assert rows[1] == rows[0] and found["wall_min_s"][0] == rows[0]["wall_min_s"] and found.rows == 2


def test_what_cannot_be_studied_is_said(capsys: pytest.CaptureFixture[str]) -> None:
    scene = pliant.Scene.from_toml(CHAIN)
    with pytest.raises(pliant.SceneError, match="did you mean `rk4`"):
        pliant.study(scene, integrators=["rk5"])
    with pytest.raises(pliant.SceneError, match="study.steps"):
        pliant.study(scene, steps=[-1.0])
    with pytest.raises(ValueError, match="no exact solution"):
        pliant.study(beam(), integrators=["rk4"], steps=[1e-3], reference="exact")
    with pytest.raises(ValueError, match='"auto", "exact" or "computed"'):
        pliant.study(scene, reference="best")  # type: ignore[arg-type]
    for wrong in ({"repeats": 0}, {"threads": 0}, {"budget": -1.0}):
        with pytest.raises(ValueError, match=f"{next(iter(wrong))} must be"):
            pliant.study(scene, **wrong)  # type: ignore[arg-type]
    for values in ([], 1e5):
        with pytest.raises(ValueError, match="varied by a list"):
            pliant.study(scene, vary={"body.0.springs.stiffness": values})  # type: ignore[dict-item]
    pliant.study(scene, integrators=["rk4"], steps=[0.02], tolerances=[], repeats=1, progress=True)
    out, err = capsys.readouterr()
    assert out == "" and err.startswith("rk4, step 0.02 s: error ")


def test_a_run_that_fails_is_a_row() -> None:
    found = pliant.study(
        pliant.Scene.from_toml(CHAIN),
        integrators=["velocity-verlet"],
        steps=[0.05, 0.01],
        tolerances=[],
        repeats=1,
    )
    assert found["status"].tolist() == ["energy-blow-up", "ok"] and np.isnan(found["err_q_rms"][0])
    assert found["message"][1] == "" and "energy" in found["message"][0]


@pytest.mark.parametrize("call", ["study", "stress", "stability"])
def test_ctrl_c_ends_a_report(call: str) -> None:
    scene = pliant.Scene.from_toml(SCENES / "study" / "beam.toml")
    long = {
        "study": lambda callback: pliant.study(
            scene.with_changes({"time.duration": 1e3}), steps=[1e-3], budget=1e3
        ),
        "stress": lambda callback: [pliant.stress(only=["D10"], callback=callback) for _ in range(1000)],
        "stability": lambda callback: [
            pliant.stability(scene, integrators=["velocity-verlet"] * 100, quick=True, callback=callback)
        ],
    }
    # Not before it is at work: functions here must not be what is interrupted.
    begun = threading.Event()

    def interrupt() -> None:
        begun.wait(60)
        time.sleep(0.1)
        os.kill(os.getpid(), signal.SIGINT)

    thread = threading.Thread(target=interrupt)
    if call == "study":
        begun.set()
    thread.start()
    with pytest.raises(KeyboardInterrupt):
        long[call](lambda found: begun.set())  # type: ignore[no-untyped-call]
    thread.join()


def test_python_goes_on_while_a_study_runs() -> None:
    scene = pliant.Scene.from_toml(CHAIN)
    barrier, seen = threading.Barrier(2, timeout=60), []

    def go() -> None:
        # Each waits for the other in the middle of its study: that needs both to run.
        found = pliant.study(
            scene,
            integrators=["rk4"],
            steps=[0.02],
            tolerances=[],
            repeats=1,
            callback=lambda row: barrier.wait(),
        )
        seen.append(found["err_q_rms"][0])

    threads = [threading.Thread(target=go) for _ in range(2)]
    [thread.start() for thread in threads]
    [thread.join() for thread in threads]
    assert len(seen) == 2 and seen[0] == seen[1]


def test_the_torture_suite_is_that_of_the_command_line(programs: list[str]) -> None:
    ours = pliant.stress(only=["D8", "D10"], quick=True)
    command = [programs[0], "stress", "--only", "D8,D10", "--quick", "--json"]
    theirs = json.loads(subprocess.run(command, capture_output=True).stdout)
    assert ours.counts == theirs["counts"] and ours.rows == len(theirs["cases"]) > 4
    for i, case in enumerate(theirs["cases"]):
        for name in set(ours) - {"seconds", "notes"}:
            assert case[name] == ours[name][i] or (
                case[name] is None and cell(ours[name][i]) in ("", "nan")
            ), (i, name)
        assert "; ".join(case["notes"]) == ours["notes"][i]
    with pytest.raises(ValueError, match="no case is of these"):
        pliant.stress(only=["D99"])
    with pytest.raises(ValueError, match='no linear solver "lu"; there are auto'):
        pliant.stress(solvers=["lu"])
    with pytest.raises(TypeError, match="only is a list"):
        pliant.stress(only="D10")


def test_a_scene_is_put_through_it() -> None:
    found = pliant.stress(beam(), integrators=["symplectic-euler"], quick=True)
    as_it_is = found["name"].tolist().index("as it is")
    assert found["verdict"][as_it_is] == "pass" and found.rows > 3
    assert set(found["integrator"]) == {"symplectic-euler"} and set(found["material"]) == {"corotated"}
    # A hundred times the step is above the limit of an explicit scheme, which is tried at that limit.
    longer = found["name"].tolist().index("100 times the step")
    steps = found["step_size"]
    assert found["verdict"][longer] == "pass" and steps[as_it_is] < steps[longer] < 100.0 * steps[as_it_is]
    with pytest.raises(ValueError, match="quasi-static"):
        pliant.stability(beam().with_changes({"time.integrator": "quasi-static"}), quick=True)
    with pytest.raises(pliant.SceneError, match="no integrator `rk5`"):
        pliant.stress(beam(), integrators=["rk5"])


# verification A1b: the limit of symplectic Euler is h omega = 2.
def test_stability_is_that_of_the_command_line(programs: list[str]) -> None:
    ours = pliant.stability(
        pliant.Scene.from_toml(CHAIN), integrators=["velocity-verlet", "implicit-euler"], quick=True
    )
    command = [
        programs[0],
        "stability",
        CHAIN,
        "--integrators",
        "velocity-verlet,implicit-euler",
        "--quick",
        "--json",
    ]
    theirs = json.loads(subprocess.run(command, capture_output=True, check=True).stdout)
    for name in ("integrator", "measured", "trials"):
        assert ours[name].tolist() == [limit[name] for limit in theirs["limits"]]
    assert ours["amplitude"].tolist() == [drift["amplitude"] for drift in theirs["energy_drift"]]
    assert ours["predicted"].tolist() == [theirs["limits"][0]["predicted"], float("inf")]
    assert (
        ours.map.status.tolist() == theirs["map"]["status"]
        and ours.map.steps.tolist() == theirs["map"]["steps"]
    )
    curve = theirs["amplification"][1]
    here = ours.amplification["integrator"] == curve["integrator"]
    assert ours.amplification["measured"][here].tolist() == curve["measured"]
    # Ten masses between two walls: omega_10 = 2 sqrt(k / m) sin(10 pi / 22).
    omega = 2.0 * np.sqrt(100.0 / 0.1) * np.sin(10 * np.pi / 22)
    assert abs(ours["measured"][0] * omega / 2 - 1) < 3e-3
    with pytest.raises(ValueError, match="no dynamic integrator `rk5`; there are"):
        pliant.stability(pliant.Scene.from_toml(CHAIN), integrators=["rk5"])
    with pytest.raises(pliant.SceneError, match="Poisson"):
        pliant.stability(
            pliant.Scene.from_toml(CHAIN), integrators=["velocity-verlet"], against="poisson", quick=True
        )


def test_reports_go_to_pandas_and_matplotlib(tmp_path: Path) -> None:
    pytest.importorskip("pandas")
    matplotlib = pytest.importorskip("matplotlib")
    matplotlib.use("agg")
    found = pliant.study(
        pliant.Scene.from_toml(CHAIN),
        integrators=["velocity-verlet", "rk4"],
        steps=[0.05, 0.02, 0.01],
        tolerances=[],
        repeats=1,
    )
    table = found.to_pandas()
    assert table.shape == (6, len(found)) and table["integrator"].unique().tolist() == [
        "velocity-verlet",
        "rk4",
    ]
    axes = found.plot("step")
    lines = {line.get_label(): line.get_xydata() for line in axes.lines}
    rk4 = found["integrator"] == "rk4"
    np.testing.assert_array_equal(lines["rk4"], np.stack([found["dt"][rk4], found["err_q_rms"][rk4]], axis=1))
    # The run that blew up is a cross, not a point of the line.
    assert len(lines["velocity-verlet"]) == 2 and any(line.get_marker() == "x" for line in axes.lines)
    with pytest.raises(ValueError, match="no variant 'x'"):
        found.plot(variant="x")
    survey = pliant.stability(pliant.Scene.from_toml(CHAIN), integrators=["velocity-verlet"], quick=True)
    cells = survey.plot().images[0].get_array()
    assert cells is not None and ((cells == 0) == (survey.map.status == "ok")).all()
    assert len(survey.plot("amplification").lines) == 2
    suite = pliant.stress(only=["D7"], quick=True)
    cells = suite.plot().images[0].get_array()
    assert cells is not None and (cells == 0).sum() == suite.counts["pass"]
    pictured = next(i for i, picture in enumerate(suite.pictures) if picture is not None)
    drawn = suite.plot(pictured).collections[0]
    picture = suite.pictures[pictured]
    assert picture is not None
    np.testing.assert_array_equal(drawn.get_array(), picture["J"])
    drawn.axes.figure.savefig(tmp_path / "end.png")


def test_columns_have_the_words_of_the_library() -> None:
    """Units and descriptions come from the documentation in Rust; every column has some."""
    study = pliant.study(
        pliant.Scene.from_toml(CHAIN), integrators=["rk4"], steps=[0.02], tolerances=[], repeats=1
    )
    assert (
        study.units["peak_rss_mb"] == "MB"
        and study.units["fail_time"] == "s"
        and study.units["newton_tol"] == "m"
    )
    described = {name: text for name, text in study.descriptions.items() if text}
    assert set(described) >= set(study) - {"status"}
    for table in (pliant.Study, pliant.Stress, pliant.Stability):
        assert table.__doc__ is not None and table.__doc__.count("``: ") >= 8
    assert "``measured``: The largest step with which all steps of a trial were taken [s]" in str(
        pliant.Stability.__doc__
    )
