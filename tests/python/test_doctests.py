"""Every public function and method has an example, and all examples do what they show."""

from __future__ import annotations

import doctest
import inspect
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pliant
import pytest
from conftest import ROOT, beam
from test_docs import NAMES, docstring

#: Packages that examples of these names stand on.
NEEDS = {
    "to_meshio": "meshio",
    "to_pyvista": "pyvista",
    "to_pandas": "pandas",
    "to_rerun": "rerun",
    "plot": "matplotlib",
    "render": "matplotlib",
    "stiffness": "scipy",
    "damping": "scipy",
    "mass": "scipy",
}
#: Results of calls, whose examples are those of what they are results of.
RESULTS = {
    name for name, value in NAMES.items() if inspect.isclass(value) and "Attributes\n-----" in docstring(name)
} | {
    "Frame",
    "Frames",
    "State",
    "Superposition",
    "Trajectory",
    "View",
    "LiveView",
}
FLAGS = doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE


def is_to_have_one(name: str) -> bool:
    value = NAMES[name]
    if inspect.isdatadescriptor(value) or name in RESULTS:
        return False
    # Methods of mappings and exceptions are those of Python.
    return "." not in name or _is_ours(name)


def _is_ours(name: str) -> bool:
    owner, _, method = name.partition(".")
    classes = [base for base in getattr(pliant, owner).__mro__ if method in vars(base)]
    return classes[0].__module__.startswith("pliant")


@pytest.mark.parametrize("name", sorted(filter(is_to_have_one, NAMES)))
def test_it_has_an_example(name: str) -> None:
    examples = doctest.DocTestParser().get_examples(docstring(name))
    assert examples, f"{name} has no example"
    assert not any(doctest.SKIP in example.options for example in examples), (
        f"{name} has an example that does not run"
    )


@pytest.fixture
def names(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> dict[str, Any]:
    """What examples take for granted: a beam in all shapes, in a directory of their own."""
    (tmp_path / "scenes").symlink_to(ROOT / "scenes")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("webbrowser.open", lambda url: True)
    scene = beam(probe=[{"name": "tip", "at": [0.4, 0.1]}])
    channels = ["state", "mesh", "energy", "reactions", "contacts", "jacobian"]
    pliant.Simulation(scene.with_changes({"output.channels": channels, "contact": {"distance": 1e-3}})).run(
        record="beam.mcap"
    )
    shutil.copy("beam.mcap", "killed.mcap.part")
    linear = scene.with_changes({"body.0.elastic": {"linear": {"young": 1e5, "poisson": 0.3}}})
    return {
        **{name: getattr(pliant, name) for name in pliant.__all__},
        "np": np,
        "pliant": pliant,
        "scene": scene,
        "linear": linear,
        "simulation": pliant.Simulation(scene),
        "trajectory": pliant.load("beam.mcap"),
        "env": pliant.vector(scene, 2, action=pliant.ForceAction([9], axes="y")),
    }


@pytest.mark.filterwarnings("ignore::RuntimeWarning")
@pytest.mark.parametrize(
    "name", ["pliant", *sorted(name for name in NAMES if ">>> " in (inspect.getdoc(NAMES[name]) or ""))]
)
def test_its_example_does_what_it_shows(name: str, names: dict[str, Any]) -> None:
    needed = NEEDS.get(name.rpartition(".")[2])
    if needed is not None:
        pytest.importorskip(needed)
    if needed == "matplotlib":
        import matplotlib

        matplotlib.use("agg")
    text = inspect.getdoc(pliant) if name == "pliant" else docstring(name)
    assert text is not None
    test = doctest.DocTestParser().get_doctest(text, names, name, None, None)
    said: list[str] = []
    failed, _ = doctest.DocTestRunner(optionflags=FLAGS).run(test, out=said.append)
    assert failed == 0, "".join(said)
