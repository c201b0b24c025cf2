"""Scenes: read and built by the same code, with the same messages."""

from __future__ import annotations

import pickle
import re
from pathlib import Path

import numpy as np
import pliant
import pytest
from conftest import SCENES, beam

TEXT = (SCENES / "cantilever_fem_2d.toml").read_text()


def test_a_path_and_its_text_are_the_same_scene(tmp_path: Path) -> None:
    path = SCENES / "cantilever_fem_2d.toml"
    by_path, by_name, by_text = (pliant.Scene.from_toml(given) for given in (path, str(path), TEXT))
    assert by_path == by_name != beam()
    # Files that it might name are relative to elsewhere.
    assert by_text != by_path and by_text.to_toml() == by_path.to_toml()
    assert by_path.text == by_text.text == TEXT
    assert by_path.name == str(path) and by_text.name == "<scene>"
    assert (by_path.dimension, by_path.step_size, by_path.bodies) == (2, 1.67e-4, ["beam"])
    assert pliant.Scene.from_toml(by_text.to_toml()) == by_text


def test_a_scene_from_tables_is_that_of_the_file() -> None:
    scene = pliant.Scene(
        title="The lecture's cantilever: linear triangles, corotated, symplectic Euler",
        dimension=2,
        time={"integrator": "symplectic-euler", "step": "0.167 ms", "duration": 2.0},
        world={"gravity": (0, -9.8), "walls": [{"normal": [1.0, 0.0], "offset": 0.1}], "nbody": None},
        body=[
            {
                "name": "beam",
                "mesh": {
                    "grid": {"cells": np.array([19, 3]), "spacing": 0.03125, "origin": np.array([0.1, 0.6])}
                },
                "elastic": {"corotated": {"young": "3 MPa", "poisson": np.float64(0.0)}},
                "mass": {"per_vertex": 1.0},
                "pin": [{"box": {"min": [0.1, 0.6], "max": [0.1, 0.7]}}],
            }
        ],
        output={"rate": 60.0, "channels": ["state", "mesh", "energy"]},
    )
    from_file = pliant.Scene.from_toml(TEXT)
    changed = {"time.step": scene.step_size}
    assert scene.with_changes(changed) == from_file.with_changes(changed)


def test_a_mesh_comes_from_arrays() -> None:
    points = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], dtype=np.float32)
    triangles = np.array([[0, 1, 2], [0, 2, 3]])
    body = {
        "mesh": {"inline": {"points": points, "triangles": triangles}},
        "elastic": {"neo-hookean": {"young": 1e5, "poisson": 0.3}},
        "mass": {"density": 1000.0},
    }
    time = {"integrator": "rk4", "step": 1e-4, "duration": 1.0}
    simulation = pliant.Simulation(pliant.Scene(dimension=2, time=time, body=[body]))
    np.testing.assert_array_equal(simulation.rest_positions, points)
    np.testing.assert_array_equal(simulation.bodies[0]["triangles"], triangles)
    # A third of the area of its triangles for each vertex.
    np.testing.assert_allclose(simulation.masses, np.array([1, 0.5, 1, 0.5]) * 1000 / 3)


def test_mistakes_have_lines_and_columns() -> None:
    with pytest.raises(pliant.SceneError) as caught:
        pliant.Scene.from_toml(TEXT.replace("poisson = 0.0", "poisson = 0.5"))
    error = caught.value
    assert isinstance(error, ValueError)
    line = next(i for i, text in enumerate(TEXT.splitlines(), 1) if "poisson" in text)
    column = TEXT.splitlines()[line - 1].index("poisson = ") + len("poisson = ") + 1
    assert (error.line, error.column) == (line, column)
    assert "`poisson` = 0.5" in error.message and f"<scene>:{line}:{column}" in str(error)
    again = pickle.loads(pickle.dumps(error))
    assert (again.line, again.problems, str(again)) == (error.line, error.problems, str(error))


def test_tables_are_checked_by_the_same_code() -> None:
    with pytest.raises(pliant.SceneError, match="did you mean `rk4`") as caught:
        beam(**{"time.integrator": "rk5"})
    assert caught.value.problems[0]["path"] == "time.integrator"
    with pytest.raises(pliant.SceneError, match="missing field `time`"):
        pliant.Scene(dimension=2)
    with pytest.raises(pliant.SceneError, match="body.7"):
        beam(**{"body.7.mass": 1.0})


def test_mistakes_in_tables_name_paths_and_no_lines() -> None:
    body = {
        "mesh": {"grid": {"cells": [1, 1], "spacing": 0.1}},
        "elastic": {"neo-hookean": {"young": 1e5, "poisson": 0.7}},
        "mass": {"density": "3 kg"},
    }
    time = {"integrator": "rk4", "step": -1e-4, "duration": 1.0}
    with pytest.raises(pliant.SceneError) as caught:
        pliant.Scene(dimension=2, time=time, body=[body, body])
    said = caught.value.message
    assert (caught.value.line, caught.value.column) == (None, None)
    assert re.search(r"error: body.1.mass.density: `density`: `3 kg` is a mass", said), said
    assert "<scene>" not in said and " --> " not in said
    body["mass"] = {"density": 1000.0}
    with pytest.raises(pliant.SceneError) as caught:
        pliant.Scene(dimension=2, time=time, body=[body])
    first = "error: body.0.elastic.neo-hookean.poisson: `poisson` = 0.7: "
    assert first in caught.value.message and "below 0.5" in caught.value.message
    assert "error: time.step: `step` must be positive and finite, got -0.0001" in caught.value.message
    assert {problem["path"] for problem in caught.value.problems} == {
        "time.step",
        "body.0.elastic.neo-hookean.poisson",
    }
    # The path is one to be set, and a copy of the scene says the same.
    for scene in (
        beam(),
        pickle.loads(pickle.dumps(beam())),
        pickle.loads(pickle.dumps(pliant.Simulation(beam()))).scene,
    ):
        with pytest.raises(
            pliant.SceneError, match="^error: body.0.elastic.corotated.poisson: `poisson` = 0.7"
        ) as caught:
            scene.with_changes({"body.0.elastic.corotated.poisson": 0.7})
        assert caught.value.line is None
    with pytest.raises(
        pliant.SceneError, match='(?s)world.gravity.1: `gravity`: unknown name `g`.*the value is "-g'
    ):
        beam(**{"world.gravity": [0.0, "-g * sin(t)"]})


def test_what_is_no_scene_is_a_type_error() -> None:
    with pytest.raises(TypeError, match="`body.0.mesh` is a object"):
        pliant.Scene(dimension=2, body=[{"mesh": object()}])
    with pytest.raises(TypeError, match="`body.0` is None"):
        pliant.Scene(dimension=2, body=[None])
    endless: list[object] = []
    endless.append(endless)
    with pytest.raises(ValueError, match="nested too deep"):
        pliant.Scene(body=endless)
    with pytest.raises(ValueError, match="too large a whole number"):
        pliant.Scene(dimension=1 << 80)


def test_files_that_cannot_be_read_say_so(tmp_path: Path) -> None:
    with pytest.raises(pliant.SceneError, match="cannot read .*absent.toml"):
        pliant.Scene.from_toml(tmp_path / "absent.toml")


def test_an_unstable_step_is_refused_where_it_stands() -> None:
    with pytest.raises(pliant.SceneError, match="allows at most") as caught:
        pliant.Simulation(beam(**{"time.step": 0.1}))
    assert caught.value.problems[0]["path"] == "time.step"


def test_a_scene_pickles_with_its_directory(tmp_path: Path) -> None:
    scene = pliant.Scene.from_toml(SCENES / "bunny.toml")
    again = pickle.loads(pickle.dumps(scene))
    assert again == scene and again.text == scene.text and again.name == scene.name
    # Its mesh is a file beside it.
    assert pliant.Simulation(again).vertex_count == pliant.Simulation(scene).vertex_count
