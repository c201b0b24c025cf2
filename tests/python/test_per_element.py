"""Young's modulus as an array, one for each element."""

from __future__ import annotations

import pickle
from typing import Any

import numpy as np
import pliant
import pytest
from conftest import beam

YOUNG = np.linspace(5e4, 1e5, 8)
PATH = "body.0.elastic.corotated.young"
IMPLICIT = {"integrator": "newmark", "step": 2e-3, "duration": 0.1}


def deformed(**changes: Any) -> pliant.Simulation:
    simulation = pliant.Simulation(beam(**changes))
    x = simulation.rest_positions
    simulation.positions = x + 0.05 * np.sin(20.0 * x[:, ::-1])
    return simulation


@pytest.mark.parametrize("order", [1, 2])
def test_each_element_has_its_own_stress_and_stiffness(order: int) -> None:
    pytest.importorskip("scipy")
    changes = {"body.0.order": order}
    one, mixed = deformed(**changes), deformed(**changes, **{PATH: YOUNG})
    factor = (YOUNG / 1e5)[:, None, None]
    np.testing.assert_allclose(
        mixed.stress("first-piola"), factor * one.stress("first-piola"), rtol=1e-12, atol=1e-9
    )
    np.testing.assert_allclose(
        mixed.measure("energy-density")[:, 0],
        factor[:, 0, 0] * one.measure("energy-density")[:, 0],
        rtol=1e-12,
    )
    # Energies and stiffnesses are sums over elements, and linear in each modulus.
    other = deformed(**changes, **{PATH: 1.5e5 - YOUNG})
    half = deformed(**changes, **{PATH: 5e4})
    for quantity in (lambda each: each.stiffness().toarray(), lambda each: each.energy()["elastic"]):
        np.testing.assert_allclose(
            quantity(mixed) + quantity(other), quantity(one) + quantity(half), rtol=1e-11, atol=1e-6
        )
    force = [each.reactions()["beam/left"][0] for each in (mixed, other, one, half)]
    np.testing.assert_allclose(force[0] + force[1], force[2] + force[3], rtol=1e-11)


@pytest.mark.parametrize("time", [None, IMPLICIT])
def test_equal_moduli_are_those_of_the_body(time: Any) -> None:
    changes = {} if time is None else {"time": time}
    for scene in (beam(**changes, **{PATH: np.full(8, 1e5)}), beam(**changes)):
        simulation = pliant.Simulation(scene)
        simulation.step(20)
        if "elastic_factor" in scene.text:
            first = simulation.positions
    np.testing.assert_array_equal(first, simulation.positions)


def test_it_is_said_in_a_scene_and_while_it_runs() -> None:
    body = {
        "name": "beam",
        "mesh": {"grid": {"cells": [4, 1], "spacing": 0.1}},
        "elastic": {"corotated": {"young": YOUNG, "poisson": 0.3}},
        "mass": {"density": 1000.0},
        "pin": [{"name": "left", "vertices": [0, 1]}],
    }
    time = {"integrator": "symplectic-euler", "step": 1e-3, "duration": 0.1}
    said = pliant.Scene(dimension=2, time=time, world={"gravity": [0.0, -9.8]}, body=[body])
    assert said == beam(**{PATH: YOUNG}) == beam(**{"body.beam.elastic.young": YOUNG})
    assert said._value("body.0.elastic_factor") == (YOUNG / 1e5).tolist()
    simulation = pliant.Simulation(beam())
    simulation.step(5)
    simulation.set({"body.beam.elastic.young_per_element": YOUNG})
    before = simulation.positions
    again = pickle.loads(pickle.dumps(simulation))
    for each in (simulation, again):
        each.step(5)
    assert (simulation.positions != before).any()
    np.testing.assert_array_equal(again.positions, simulation.positions)
    plain = pliant.Simulation(beam())
    plain.step(10)
    assert (plain.positions != simulation.positions).any()


def test_derivatives_are_those_of_differences() -> None:
    """Of the height of the tip, by the modulus of one element and of all."""

    def loss(frame: pliant.Frame) -> Any:
        if frame.index < 20:
            return None
        by = np.zeros_like(frame.positions)
        by[9, 1] = 1.0
        return frame.positions[9, 1], by

    def height(young: np.ndarray) -> float:
        simulation = pliant.Simulation(beam(**{PATH: young}))
        simulation.step(20)
        return float(simulation.positions[9, 1])

    names = ["body.beam.elastic.young", "body.beam.elastic.young_per_element"]
    found = pliant.Simulation(beam(**{PATH: YOUNG})).gradient(loss, names, steps=20)
    step = 10.0
    for element in (0, 5):
        moved = np.zeros(8)
        moved[element] = step
        difference = (height(YOUNG + moved) - height(YOUNG - moved)) / (2 * step)
        np.testing.assert_allclose(found[names[1]][element], difference, rtol=1e-5)
    # All together: as the modulus of the stiffest element grows, others do in proportion.
    np.testing.assert_allclose(found[names[0]], found[names[1]] @ (YOUNG / 1e5), rtol=1e-10)
    known = pliant.Simulation(beam(**{PATH: YOUNG})).gradient_names()
    assert {"body.beam.elastic.poisson", "body.beam.rest"} <= set(known)
    assert "body.beam.elastic.poisson_per_element" not in known


HEXAHEDRA = {"body.0.mesh": {"grid": {"cells": [4, 1], "spacing": 0.1, "element": "quadrilateral"}}}


@pytest.mark.parametrize(
    ("changes", "error", "message"),
    [
        (
            {PATH: YOUNG[:5]},
            pliant.SceneError,
            "body.0.elastic_factor: the list has 5 numbers, the body has 8 elements",
        ),
        (
            {PATH: -YOUNG},
            ValueError,
            r"`body.0.elastic.corotated.young` of element 0 is -50000.0: give a positive number \[Pa\]",
        ),
        ({PATH: np.array([])}, ValueError, "is an empty array"),
        (
            {"body.0.elastic_factor": [1.0] * 7 + [0.0]},
            pliant.SceneError,
            r"body.0.elastic_factor.7: .* positive and finite, got 0.0",
        ),
        (
            {"body.0.elastic.corotated.poisson": np.full(8, 0.3)},
            pliant.SceneError,
            "body.0.elastic.corotated.poisson: .* found a list",
        ),
        (
            {PATH: YOUNG, "body.0.damping": {"stiffness_proportional": 1e-4}},
            pliant.SceneError,
            "does not reach `stiffness_proportional`",
        ),
        (
            {**HEXAHEDRA, "body.0.elastic_factor": 0.5},
            pliant.SceneError,
            "is for triangles, tetrahedra and cells of `order = 2`, and these are quadrilaterals",
        ),
        ({"body.rope.elastic.young": YOUNG}, KeyError, "rope"),
    ],
)
def test_what_cannot_be_is_refused(changes: dict[str, Any], error: type[Exception], message: str) -> None:
    with pytest.raises(error, match=message):
        pliant.Simulation(beam(**changes))
