"""Every public name says what it takes, what it returns, in which shapes and units."""

from __future__ import annotations

import ast
import inspect
import re
from collections.abc import Iterator
from pathlib import Path

import pliant
import pytest

#: What numpydoc must not find: no docstring; sections unknown, in the wrong order, or empty; parameters left
#: out, made up, in the wrong order, without a type or a description; returned values left out or not
#: described.
CODES = {
    "GL06",
    "GL07",
    "GL08",
    "SS01",
    "SS03",
    "SS05",
    "PR01",
    "PR02",
    "PR03",
    "PR04",
    "PR05",
    "PR06",
    "PR07",
    "RT01",
    "RT03",
    "RT05",
    "YD01",
}
#: Arrays of numbers without a unit, or of one that depends on what is asked for.
UNITLESS = {
    "Simulation.nodal_stress",
    "Simulation.deformation_gradient",
    "Simulation.measure",
    "Trajectory.measure",
    "Trajectory.probe",
    "Trajectory.energy",
    "VectorEnvironment.reset",
    "VectorEnvironment.step",
}


def public() -> Iterator[tuple[str, object]]:
    """Names and what they are: functions, classes, their methods and properties."""
    for name in pliant.__all__:
        value = getattr(pliant, name)
        if name.startswith("_"):
            continue
        yield name, value
        if inspect.isclass(value):
            members = {
                key: member
                for base in reversed(value.__mro__)
                if base.__module__.startswith("pliant")
                for key, member in vars(base).items()
            }
            for key, member in members.items():
                if key.startswith("_") or not (
                    callable(getattr(value, key)) or inspect.isdatadescriptor(member)
                ):
                    continue
                yield f"{name}.{key}", member if inspect.isdatadescriptor(member) else getattr(value, key)


NAMES = dict(public())


def docstring(name: str) -> str:
    text = inspect.getdoc(NAMES[name])
    assert text, f"{name} has no docstring"
    return text


def is_property(name: str) -> bool:
    return inspect.isdatadescriptor(NAMES[name])


@pytest.mark.parametrize("name", NAMES)
def test_it_has_a_numpydoc_docstring(name: str) -> None:
    validate = pytest.importorskip("numpydoc.validate").validate
    found = [(code, text) for code, text in validate(f"pliant.{name}")["errors"] if code in CODES]
    if inspect.isclass(NAMES[name]) and "Attributes\n-----" in docstring(name):
        # What is handed to users, and not made by them, says what it has in place of what it takes.
        found = [(code, text) for code, text in found if code != "PR01"]
    assert not found


def signatures() -> dict[str, ast.FunctionDef]:
    """Methods of the compiled classes, which have no source to look at: as the stub has them."""
    stub = Path(inspect.getfile(pliant)).with_name("_pliant.pyi")
    classes = [node for node in ast.parse(stub.read_text()).body if isinstance(node, ast.ClassDef)]
    return {
        f"{node.name}.{method.name}": method
        for node in classes
        for method in node.body
        if isinstance(method, ast.FunctionDef) and f"{node.name}.{method.name}" in NAMES
    }


def test_compiled_methods_say_what_they_return() -> None:
    checked = 0
    for name, method in signatures().items():
        assert method.returns is not None
        returns = ast.unparse(method.returns)
        if is_property(name):
            # "float: Simulated time [s]."
            kind = docstring(name).split(":", 1)[0]
            assert re.match(r"(ndarray|float|int|str|list|dict|Scene|State)\b", kind), f"{name}: {kind}"
        else:
            says = "Returns\n-------" in docstring(name)
            assert says == (returns != "None"), f"{name} returns {returns}"
        checked += 1
    assert checked > 50


def test_arrays_have_shapes_and_units() -> None:
    checked = 0
    for name in NAMES:
        if inspect.isclass(NAMES[name]):
            continue
        for line in re.split(r"\n(?=\S)", docstring(name)):
            if not re.match(r"(\w+ : )?(ndarray|dict of str to ndarray|scipy)", line):
                continue
            assert "shape (" in line, f"{name}: {line}"
            assert name in UNITLESS or re.search(r"\[[^\]]*\b(m|kg|Pa|N|J|s|rad)\b[^\]]*\]", line), (
                f"{name}: {line}"
            )
            checked += 1
    assert checked > 25


def test_materials_and_schemes_have_the_words_of_the_library() -> None:
    materials, schemes = pliant.catalogue("materials"), pliant.catalogue("integrators")
    assert "F" in materials["neo-hookean"]["formula"] and materials["neo-hookean"]["source"]
    assert schemes["rk4"]["order"] == 4 and schemes["velocity-verlet"]["symplectic"] is True
    # What a scene is told of is what there is.
    with pytest.raises(pliant.SceneError) as caught:
        pliant.Scene(dimension=2, time={"integrator": "none", "step": 1.0, "duration": 1.0}, body=[])
    assert all(f"`{name}`" in caught.value.message for name in schemes)
    channels = pliant.catalogue("channels")
    assert {"green-strain", "von-mises", "state"} <= set(channels) and all(
        item["summary"] for item in channels.values()
    )
    with pytest.raises(ValueError, match="no family 'colours'; there are channels, elements"):
        pliant.catalogue("colours")  # type: ignore[arg-type]
