"""Errors of quantities, total error against run time, runs for an accuracy."""

import pytest

import pliant

COOK = """
dimension = 2
time = { integrator = "quasi-static", step = 1.0, duration = 1.0 }
[[body]]
mesh = { cooks_membrane = { cells = [8, 8] } }
elastic = { linear = { young = 1.0, poisson = 0.3333333333333333, plane = "stress" } }
mass = { density = 1.0 }
pin = [{ group = "left" }]
load = [{ group = "right", traction = ["0", "1/16"] }]
[[probe]]
name = "middle"
at = [48.0, 52.0]
"""
# Limit of an independent program (section C9 of the set-ups).
RISE = 23.96774


@pytest.fixture
def scene() -> pliant.Scene:
    return pliant.Scene.from_toml(COOK)


def test_errors_hold_the_truth(scene: pliant.Scene) -> None:
    runs: list[int] = []
    fine = scene.with_changes({"body.0.mesh.cooks_membrane.cells": [16, 16]})
    found = pliant.errors(fine, callback=runs.append)
    assert list(found) == ["middle.x", "middle.y"] and runs
    of = found["middle.y"]
    assert of.unit == "m" and abs(of.value - RISE) <= of.interval
    assert of.parts["step"]["estimate"]["interval"] == 0.0
    assert of.parts["mesh"]["expected_order"] == 2.0


def test_refinement_is_a_table(scene: pliant.Scene) -> None:
    found = pliant.refine(scene, "middle.y", levels=3, elements=["linear", "quadratic"])
    assert found.rows == 6 and found.units["middle.y"] == "m"
    assert list(found["cells"]) == ["8x8", "8x8", "16x16", "16x16", "32x32", "32x32"]
    reference = found.quantities["middle.y"]["reference"]
    assert abs(reference["value"] - RISE) <= reference["uncertainty"]
    errors = found["error of middle.y"]
    assert errors.min() < 1e-3 < errors.max()


def test_solve_proves_its_wish(scene: pliant.Scene) -> None:
    found = pliant.solve(scene, "middle.y", "1 %")
    assert abs(found.proof.value - RISE) <= found.wish and found.proof.interval <= found.wish
    assert not found.removed
    again = pliant.errors(scene.with_changes(found.changes), "middle.y")["middle.y"]
    assert again.value == found.proof.value


def test_what_is_not_there_is_refused(scene: pliant.Scene) -> None:
    with pytest.raises(ValueError, match="`top.y`"):
        pliant.errors(scene, "top.y")
    with pytest.raises(ValueError, match="is no quantity"):
        pliant.refine(scene, "middle")
    with pytest.raises(ValueError, match="not above 0"):
        pliant.solve(scene, "middle.y", "0 %")
    with pytest.raises(RuntimeError, match="not reached"):
        pliant.solve(scene, "middle.y", 1e-9, budget=1e-3)
