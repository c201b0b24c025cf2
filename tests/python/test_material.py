"""Materials written in Python."""

from __future__ import annotations

import pickle
import time
import warnings

import numpy as np
import numpy.typing as npt
import pliant
import pytest
from conftest import beam

Array = npt.NDArray[np.float64]
MU, LAMBDA = 1e5 / 2.6, 0.3e5 / (1.3 * 0.4)


# lecture 16 and 17: St. Venant-Kirchhoff.
def strain(f: Array) -> Array:
    return 0.5 * (np.swapaxes(f, 1, 2) @ f - np.eye(f.shape[1]))


def density(f: Array) -> Array:
    e = strain(f)
    return MU * (e**2).sum(axis=(1, 2)) + LAMBDA / 2 * np.trace(e, axis1=1, axis2=2) ** 2


def stress(f: Array) -> Array:
    e = strain(f)
    return f @ (2 * MU * e + LAMBDA * np.trace(e, axis1=1, axis2=2)[:, None, None] * np.eye(f.shape[1]))


def tangent(f: Array) -> Array:
    e, eye = strain(f), np.eye(f.shape[1])
    s = 2 * MU * e + LAMBDA * np.trace(e, axis1=1, axis2=2)[:, None, None] * eye
    return (
        np.einsum("ik,mlj->mijkl", eye, s)
        + LAMBDA * np.einsum("mij,mkl->mijkl", f, f)
        + MU * (np.einsum("mkj,mil->mijkl", f, f) + np.einsum("mib,mkb,jl->mijkl", f, f, eye))
    )


STVK = pliant.Material(density, stress)
EXACT = pliant.Material(density, stress, tangent)


def scene(integrator: str) -> pliant.Scene:
    return beam(**{"body.0.elastic": {"stvk": {"young": 1e5, "poisson": 0.3}}, "time.integrator": integrator})


@pytest.mark.parametrize("material", [STVK, EXACT])
@pytest.mark.parametrize("integrator", ["velocity-verlet", "implicit-midpoint"])
def test_a_material_in_python_is_the_same_material(integrator: str, material: pliant.Material) -> None:
    ours = pliant.Simulation(scene(integrator))
    theirs = pliant.Simulation(scene(integrator), materials={"beam": material})
    for simulation in (ours, theirs):
        simulation.step(40)
    np.testing.assert_allclose(theirs.positions, ours.positions, atol=1e-9)
    assert abs(theirs.energy()["elastic"] - ours.energy()["elastic"]) < 1e-7
    np.testing.assert_allclose(theirs.stiffness().toarray(), ours.stiffness().toarray(), atol=1e-4)
    np.testing.assert_allclose(theirs.critical_step(), ours.critical_step(), rtol=1e-4)
    piola = theirs.stress("first-piola")
    np.testing.assert_allclose(piola[:, :2, :2], ours.stress("first-piola")[:, :2, :2], atol=1e-3)
    assert np.isnan(piola[:, 2, 2]).all()


def test_a_material_goes_along(simulation: pliant.Simulation) -> None:
    first = pliant.Simulation(scene("velocity-verlet"), materials={"beam": STVK})
    first.step(10)
    second, third = first.clone(), pickle.loads(pickle.dumps(first))
    first.gravity = [0.0, -5.0]
    for other in (second, third):
        other.gravity = [0.0, -5.0]
    for each in (first, second, third):
        each.step(10)
    assert first.state == second.state == third.state
    ours = pliant.Simulation(scene("velocity-verlet"))
    ours.step(10)
    ours.gravity = [0.0, -5.0]
    ours.step(10)
    np.testing.assert_allclose(first.positions, ours.positions, atol=1e-12)


def test_what_a_material_raises_comes_through() -> None:
    calls = []

    def late(f: Array) -> Array:
        calls.append(len(f))
        if len(calls) > 5:
            raise LookupError("no stress")
        return stress(f)

    simulation = pliant.Simulation(
        scene("velocity-verlet"), materials={"beam": pliant.Material(density, late)}
    )
    with pytest.raises(LookupError, match="no stress"):
        simulation.step(100)
    assert 0 < simulation.steps < 10 and set(calls) == {8}
    wrong = pliant.Material(density, lambda f: stress(f)[:, 0])
    simulation = pliant.Simulation(scene("velocity-verlet"), materials={"beam": wrong})
    with pytest.raises(ValueError, match=r"stress of a material must have shape \(8, 2, 2\), got \(8, 2\)"):
        simulation.step()
    broken = pliant.Material(lambda f: 1 / 0, stress)  # type: ignore[arg-type, return-value]
    simulation = pliant.Simulation(scene("velocity-verlet"), materials={"beam": broken})
    with pytest.raises(ZeroDivisionError):
        simulation.energy()


def test_an_element_that_is_at_fault_is_named() -> None:
    def barrier(f: Array) -> Array:
        p = stress(f)
        p[np.linalg.det(f) <= 0.0] = np.nan
        return p

    simulation = pliant.Simulation(
        scene("velocity-verlet"), materials={"beam": pliant.Material(density, barrier)}
    )
    x = simulation.positions.copy()
    x[9] = [0.2, 0.05]
    simulation.positions = x
    with pytest.raises(pliant.StepError) as caught:
        simulation.step()
    assert caught.value.element == 7 and caught.value.J is not None and caught.value.J < 0.0


def test_a_stress_that_is_no_number_is_named() -> None:
    material = pliant.Material(lambda f: np.zeros(len(f)), lambda f: np.full_like(f, np.nan))
    with pytest.raises(pliant.StepError) as raised:
        pliant.Simulation(beam(), materials={"beam": material}).step()
    assert "the stress that the material of `beam` gives for element 0" in str(raised.value)
    assert "smaller step" not in str(raised.value)
    assert (raised.value.element, raised.value.body) == (0, "beam")


def test_only_solids_of_the_scene_have_materials() -> None:
    with pytest.raises(KeyError, match="no body `rope`"):
        pliant.Simulation(scene("rk4"), materials={"rope": STVK})
    cloth = beam(
        **{
            "body.0": {
                "mesh": {"grid": {"cells": [2, 2], "spacing": 0.1}},
                "springs": {"stiffness": 1.0},
                "mass": {"total": 1.0},
            }
        }
    )
    with pytest.raises(ValueError, match="no elastic solid"):
        pliant.Simulation(cloth, materials={"body0": STVK})
    with pytest.raises(TypeError, match="Material"):
        pliant.Simulation(scene("rk4"), materials={"beam": density})  # type: ignore[dict-item]


def test_derivatives_are_checked() -> None:
    for dimension in (2, 3):
        EXACT.check(dimension)
    with pytest.raises(ValueError, match="stress is not the derivative of density"):
        pliant.Material(density, lambda f: 1.01 * stress(f)).check(3)
    with pytest.raises(ValueError, match="tangent is not the derivative of stress"):
        pliant.Material(density, stress, lambda f: 0.9 * tangent(f)).check(2)


def test_a_slow_material_says_so_once() -> None:
    def slow(f: Array) -> Array:
        time.sleep(2e-3)
        return stress(f)

    material = pliant.Material(density, slow)
    simulation = pliant.Simulation(scene("velocity-verlet"), materials={"beam": material})
    with pytest.warns(
        RuntimeWarning, match=r"the material in Python of beam is slow: its functions took \d+ % of the time"
    ) as said:
        simulation.step(50)
        simulation.step(50)
    assert len(said) == 1 and said[0].filename == __file__
    # Nor does a copy say it again; another simulation does, in the summary of its run too.
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        simulation.clone().step(50)
        pliant.Simulation(scene("velocity-verlet")).step(50)
    other = pliant.Simulation(scene("velocity-verlet"), materials={"beam": material})
    with pytest.warns(RuntimeWarning, match="is slow"):
        summary = other.run()
    assert sum("is slow" in text for text in summary.warnings) == 1


def test_measures_of_a_material_in_python_are_those_of_the_same_in_rust() -> None:
    ours = pliant.Simulation(scene("velocity-verlet"))
    theirs = pliant.Simulation(scene("velocity-verlet"), materials={"beam": STVK})
    for simulation in (ours, theirs):
        simulation.step(20)
    for name in ("corotated-strain", "energy-density", "green-strain"):
        np.testing.assert_allclose(theirs.measure(name), ours.measure(name), atol=1e-9, rtol=1e-8)


# lecture 20: a formula in a scene is the material that it says.
def test_a_formula_is_the_model_that_it_says() -> None:
    mu, lame = MU, LAMBDA
    formula = {
        "psi": "mu*(E11^2 + E22^2 + 2*E12^2 + E33^2) + lambda/2*(E11 + E22 + E33)^2",
        "parameters": {"mu": mu, "lambda": f"{lame!r} Pa"},
    }
    runs = []
    for elastic in ({"stvk": {"young": 1e5, "poisson": 0.3}}, {"expression": formula}):
        simulation = pliant.Simulation(beam().with_changes({"body.0.elastic": elastic}))
        simulation.step(100)
        runs.append(simulation.positions)
    assert np.abs(runs[0] - pliant.Simulation(beam()).positions).max() > 1e-3
    np.testing.assert_allclose(runs[1], runs[0], rtol=0, atol=1e-12)


def test_a_formula_with_stress_at_rest_is_refused() -> None:
    formula = {"psi": "mu/2*(I1 - 3)", "parameters": {"mu": 1e5}}
    with pytest.raises(pliant.SceneError, match=r"stress at rest \[Pa\], which must be 0"):
        beam().with_changes({"body.0.elastic": {"expression": formula}})
