"""What a vector of environments costs: two threads against one, and what a step costs beside its simulation.

    python vector.py [ROUNDS]

Both numbers of threads take turns, and medians are compared: the machine may do other things at the time.
"""

from __future__ import annotations

import statistics
import sys
import time

import numpy as np
import pliant


def scene(cells: tuple[int, int, int]) -> pliant.Scene:
    """A block of rubber that is held at one end."""
    return pliant.Scene(
        dimension=3,
        time={"integrator": "symplectic-euler", "step": 1e-4, "duration": 1.0},
        world={"gravity": [0.0, 0.0, -9.8]},
        body=[
            {
                "name": "block",
                "mesh": {"grid": {"cells": cells, "spacing": 0.01}},
                "elastic": {"stable-neo-hookean": {"young": 1e5, "poisson": 0.4}},
                "mass": {"density": 1000.0},
                "pin": [{"box": {"min": [-1.0, -1.0, -1.0], "max": [1e-6, 1.0, 1.0]}}],
            }
        ],
    )


def seconds(env: pliant.VectorEnvironment, actions: np.ndarray, repeats: int) -> float:
    """Time of a step of the environment [s]."""
    started = time.perf_counter()
    for _ in range(repeats):
        env.step(actions)
    return (time.perf_counter() - started) / repeats


def threads(rounds: int) -> None:
    """Sixteen environments of 3,000 tetrahedra, 20 steps in each of theirs."""
    of = {
        count: pliant.vector(
            scene((20, 5, 5)), 16, action=pliant.ForceAction([0]), observe="time", substeps=20, threads=count
        )
        for count in (1, 2)
    }
    actions = np.zeros((16, 3))
    taken: dict[int, list[float]] = {1: [], 2: []}
    for _ in range(rounds):
        for count, env in of.items():
            taken[count].append(seconds(env, actions, 2))
    ratios = [one / two for one, two in zip(taken[1], taken[2])]
    one, two = (statistics.median(taken[count]) for count in (1, 2))
    print(
        f"16 environments: {1e3 * one:.2f} ms on one thread, {1e3 * two:.2f} ms on two; {one / two:.2f} times"
    )
    print(f"ratios of turns: {min(ratios):.2f} to {max(ratios):.2f}, median {statistics.median(ratios):.2f}")
    np.testing.assert_array_equal(of[1].positions, of[2].positions)


def overhead(rounds: int) -> None:
    """Environments of a few tetrahedra and one step: what is left is not the simulation."""
    for n in (1, 16, 256):
        env = pliant.vector(
            scene((1, 1, 1)), n, action=pliant.ForceAction([0]), observe="positions", threads=1
        )
        alone = pliant.Simulation(scene((1, 1, 1)))
        actions = np.zeros((n, 3))
        of_env, of_step = [], []
        for _ in range(rounds):
            of_env.append(seconds(env, actions, 50) / n)
            started = time.perf_counter()
            alone.step(2000)
            of_step.append((time.perf_counter() - started) / 2000)
        both = statistics.median(of_env), statistics.median(of_step)
        print(
            f"{n} environments: {1e6 * both[0]:.2f} us each, a step of the simulation {1e6 * both[1]:.2f} us"
        )


if __name__ == "__main__":
    given = int(sys.argv[1]) if len(sys.argv) > 1 else 15
    threads(given)
    overhead(given)
