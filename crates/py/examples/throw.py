"""A throw that hits a target: how to swing a rope so that its end is there in time.

    python throw.py

swings a rope of rubber that is held at one end, so that the other is at a target after 0.3 s, and prints
how the miss becomes smaller. Newton's step needs the derivatives of both coordinates of the end by the
velocity of the throw: one sweep of `Simulation.gradient` for each.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pliant

Array = npt.NDArray[np.float64]

STEPS = 300
TARGET = np.array([0.55, 0.6])


def scene() -> pliant.Scene:
    """The rope, level at the start, held at the origin."""
    return pliant.Scene(
        dimension=2,
        time={"integrator": "velocity-verlet", "step": 1e-3, "duration": 0.3},
        world={"gravity": [0.0, -9.81], "ether_drag": 0.5},
        body=[
            {
                "name": "rope",
                "mesh": {"strand": {"segments": 10, "start": [0, 0], "end": [1, 0]}},
                "springs": {"stiffness": 200.0},
                "mass": {"total": 0.2},
                "pin": [{"vertices": [0]}],
            }
        ],
    )


def thrown(velocity: Array) -> tuple[pliant.Simulation, Array]:
    """The rope as it is thrown, the end at this velocity [m/s], and the part of it that each vertex has."""
    simulation = pliant.Simulation(scene())
    part = simulation.positions[:, :1]
    simulation.velocities = part * velocity
    return simulation, part


def end(velocity: Array) -> tuple[Array, Array]:
    """Where the end is at last [m], and its derivatives by the velocity of the throw [s], by rows."""
    found, rows = np.zeros(2), []
    for axis in range(2):

        def coordinate(frame: pliant.Frame, axis: int = axis) -> tuple[float, Array] | None:
            if frame.index < STEPS:
                return None
            by = np.zeros_like(frame.positions)
            by[-1, axis] = 1.0
            return float(frame.positions[-1, axis]), by

        simulation, part = thrown(velocity)
        gradient = simulation.gradient(coordinate, ["velocity"], steps=STEPS)
        found[axis] = gradient.value
        rows.append(np.sum(part * gradient["velocity"], axis=0))
    return found, np.array(rows)


def aim(velocity: Array, throws: int = 30) -> tuple[Array, list[float]]:
    """A velocity that hits, and the miss [m] of each throw that was better than the one before."""
    (found, derivatives), misses = end(velocity), []
    for _ in range(throws):
        misses.append(float(np.linalg.norm(found - TARGET)))
        if misses[-1] < 1e-10:
            break
        step = -np.linalg.solve(derivatives, found - TARGET)
        # Of a rope that whips, the derivatives hold for small steps alone.
        for part in 0.5 ** np.arange(12):
            there, derivatives_there = end(velocity + part * step)
            if np.linalg.norm(there - TARGET) < misses[-1]:
                velocity, found, derivatives = velocity + part * step, there, derivatives_there
                break
        else:
            break
    return velocity, misses


if __name__ == "__main__":
    hit, misses = aim(np.array([0.0, 2.0]))
    print("misses [m]:", ", ".join(f"{miss:.2e}" for miss in misses))
    print(f"throw with {hit[0]:.4f}, {hit[1]:.4f} m/s")
