"""Axes of a material as an array, a direction for each element."""

from __future__ import annotations

from typing import Any

import numpy as np
import pliant
import pytest

AXES = np.array([[1.0, 0.2], [0.3, 1.0], [1.0, 1.0], [-1.0, 2.0]])
FIBRES = {"shear": 1e4, "bulk": 1e5, "k1": 2e4, "k2": 1.3, "fibres": [[1.0, 0.4]]}


def block(axes: Any, cells: tuple[int, int] = (2, 1), **grid: str) -> pliant.Scene:
    """Four stretched triangles of fibres, or other elements, held at one end."""
    body = {
        "name": "block",
        "mesh": {"grid": {"cells": cells, "spacing": 0.1, **grid}},
        "elastic": {"holzapfel-gasser-ogden": FIBRES},
        "elastic_axes": {"first": axes},
        "mass": {"density": 1000.0},
        "position": {"affine": {"matrix": [[1.2, 0.1], [-0.1, 1.1]]}},
        "pin": [{"vertices": [0, 3]}],
    }
    time = {"integrator": "velocity-verlet", "step": 5e-4, "duration": 0.1}
    return pliant.Scene(dimension=2, time=time, body=[body])


def last(frame: pliant.Frame) -> tuple[float, np.ndarray] | None:
    return (frame.positions.sum(), np.ones_like(frame.positions)) if frame.index == 20 else None


TRIANGLES: dict[str, Any] = {}
QUADRILATERALS = {"cells": (4, 1), "element": "quadrilateral"}


@pytest.mark.parametrize("grid", [TRIANGLES, QUADRILATERALS], ids=["triangles", "quadrilaterals"])
def test_an_array_of_directions_has_derivatives(grid: dict[str, Any]) -> None:
    name = "body.block.elastic_axes.first_per_element"
    simulation = pliant.Simulation(block({"per_element": AXES}, **grid))
    assert name in simulation.gradient_names()
    found = np.asarray(simulation.gradient(last, [name], steps=20)[name]).reshape(AXES.shape)

    def value(axes: np.ndarray) -> float:
        moved = pliant.Simulation(block({"per_element": axes}, **grid))
        moved.step(20)
        return float(moved.positions.sum())

    for place in np.ndindex(*AXES.shape):
        change = np.zeros(AXES.shape)
        change[place] = 1e-4
        difference = (value(AXES + change) - value(AXES - change)) / 2e-4
        assert found[place] == pytest.approx(difference, rel=1e-4, abs=1e-10)
    # Lengths do not matter.
    np.testing.assert_allclose((found * AXES).sum(axis=1), 0.0, atol=1e-14)


def test_a_direction_that_is_none_is_named_by_its_element() -> None:
    with pytest.raises(pliant.SceneError, match=r"elastic_axes.first.per_element.2: .* is zero"):
        pliant.Simulation(block({"per_element": AXES * [[1], [1], [0], [1]]}))
    with pytest.raises(pliant.SceneError, match="the list has 3 directions, the body has 4 elements"):
        pliant.Simulation(block({"per_element": AXES[:3]}))
    with pytest.raises(pliant.SceneError, match="axes of element 1, whose centre is at"):
        pliant.Simulation(block({"direction": ["step(0.05, X)", 0]}))
