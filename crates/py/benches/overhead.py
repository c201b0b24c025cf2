"""What a step costs in Python beyond the step itself.

`step()` a hundred thousand times stands beside `step(100_000)`, a loop in the core.

    python crates/py/benches/overhead.py

Build the package as it is released (`pip install ./crates/py`) and close what else is running: medians of
rounds taken in turn.
"""

from __future__ import annotations

import statistics
import time

import pliant

STEPS, ROUNDS = 100_000, 9


def scene(cells: list[int]) -> pliant.Scene:
    """A bar of few elements: next to nothing to do in a step."""
    return pliant.Scene(
        dimension=2,
        time={"integrator": "symplectic-euler", "step": 1e-4, "duration": 1.0},
        body=[
            {
                "mesh": {"grid": {"cells": cells, "spacing": 0.1}},
                "elastic": {"corotated": {"young": 1e5, "poisson": 0.3}},
                "mass": {"density": 1000.0},
            }
        ],
    )


def seconds(simulation: pliant.Simulation, one_by_one: bool) -> float:
    """Time of the steps."""
    started = time.perf_counter()
    if one_by_one:
        for _ in range(STEPS):
            simulation.step()
    else:
        simulation.step(STEPS)
    return time.perf_counter() - started


for cells, view in (([1, 1], False), ([1, 1], True), ([19, 3], False), ([19, 3], True)):
    simulation = pliant.Simulation(scene(cells))
    if view:
        shown = simulation.positions_view, simulation.velocities_view
    times: dict[bool, list[float]] = {True: [], False: []}
    for _ in range(ROUNDS):
        for one_by_one in (True, False):
            times[one_by_one].append(seconds(simulation, one_by_one))
    python, core = (1e6 * statistics.median(times[key]) / STEPS for key in (True, False))
    kind = "with views" if view else "without views"
    print(
        f"{simulation.vertex_count:3} vertices, {kind:13}: {python:.2f} us a step, {core:.2f} in the core, "
        f"{python - core:.2f} more"
    )
