"""Data for learning: many short trajectories of beams of different stiffness, as one file of NumPy.

    python dataset.py beams.npz --count 32

Nothing but NumPy is needed to read it: ``np.load("beams.npz")`` has ``positions`` (N, F, n, 2),
``velocities``, ``times`` (F,), ``young`` (N,), ``gravity`` (N, 2) and ``triangles``. All of it is the same
for the same seed, whatever the number of threads.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
import pliant

#: Seconds of each trajectory, and frames in it.
DURATION, FRAMES = 0.5, 26


def scene(young: float, gravity: list[float]) -> pliant.Scene:
    """A beam, pinned at its left."""
    return pliant.Scene(
        dimension=2,
        time={"integrator": "symplectic-euler", "step": 2.5e-4, "duration": DURATION},
        world={"gravity": gravity},
        body=[
            {
                "mesh": {"grid": {"cells": [12, 3], "spacing": 0.05}},
                "elastic": {"stable-neo-hookean": {"young": young, "poisson": 0.4}},
                "mass": {"density": 1000.0},
                "pin": [{"half_space": {"normal": [1.0, 0.0], "offset": 0.0}}],
            }
        ],
    )


def generate(count: int, seed: int = 0, threads: int | None = None) -> dict[str, np.ndarray]:
    """Simulate `count` beams of random stiffness under random gravity, all at once, frame by frame."""
    random = np.random.default_rng(seed)
    young = 10.0 ** random.uniform(4.5, 5.5, count)
    angle = random.uniform(0.0, 2.0 * np.pi, count)
    gravity = 9.8 * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    simulations = [pliant.Simulation(scene(float(y), g.tolist())) for y, g in zip(young, gravity)]
    steps = round(DURATION / simulations[0].step_size / (FRAMES - 1))
    positions, velocities, times = [], [], []
    for frame in range(FRAMES):
        if frame > 0:
            pliant.rollout(simulations, steps, threads=threads)
        positions.append([one.positions for one in simulations])
        velocities.append([one.velocities for one in simulations])
        times.append(simulations[0].time)
    return {
        "positions": np.swapaxes(np.array(positions), 0, 1),
        "velocities": np.swapaxes(np.array(velocities), 0, 1),
        "times": np.array(times),
        "young": young,
        "gravity": gravity,
        "triangles": simulations[0].bodies[0]["triangles"],
    }


def main() -> None:
    """Write a file."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("file", type=Path)
    parser.add_argument("--count", type=int, default=32, help="trajectories")
    parser.add_argument("--seed", type=int, default=0)
    arguments = parser.parse_args()
    data = generate(arguments.count, arguments.seed)
    np.savez_compressed(arguments.file, **data)  # type: ignore[arg-type]
    print(f"{arguments.file}: {arguments.count} trajectories of {FRAMES} frames")


if __name__ == "__main__":
    main()
