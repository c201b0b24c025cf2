"""A soft crawler as an environment of Gymnasium: a strip of rubber that crawls by bending.

The strip lies on a slope that resists sliding backwards more than forwards, as the bristles of an earthworm
do. A policy contracts its top and its bottom fibres, in four muscles, and is rewarded for how far the strip
gets.

    python crawler.py

lets a wave of contraction run through it and prints how far it got.
"""

from __future__ import annotations

from typing import Any

import gymnasium as gym
import numpy as np
import numpy.typing as npt
import pliant

Array = npt.NDArray[np.float64]

CELLS = (12, 2)
SPACING = 0.02
#: Steps of the simulation for each of the environment: 20 ms.
SUBSTEPS = 40
#: Muscles along the strip.
MUSCLES = 4
#: Force of a contracted muscle on each of its ends [N]; the strip is one metre wide.
STRENGTH = 80.0
#: Resistance of the ground to sliding forwards and backwards [N s/m] for each vertex of the bottom.
FORWARDS, BACKWARDS = 1.0, 20.0
#: Observations end here.
LARGEST = 10.0


def scene() -> pliant.Scene:
    """The strip, on the floor."""
    return pliant.Scene(
        dimension=2,
        time={"integrator": "symplectic-euler", "step": 5e-4, "duration": 10.0},
        world={"gravity": [0.0, -9.8], "walls": [{"normal": [0.0, 1.0], "offset": 0.0}]},
        body=[
            {
                "name": "strip",
                "mesh": {"grid": {"cells": CELLS, "spacing": SPACING}},
                "elastic": {"stable-neo-hookean": {"young": 2e4, "poisson": 0.4}},
                "mass": {"density": 1000.0},
                "damping": {"strain_rate": {"shear": "20 Pa s"}},
            }
        ],
    )


class Crawler(gym.Env[npt.NDArray[np.float32], npt.NDArray[np.float32]]):
    """The crawler as an environment.

    Observations are positions relative to the mean [m], and velocities [m/s]; actions are those of each
    muscle, from -1 at rest to 1 contracted.
    """

    metadata = {"render_modes": [], "render_fps": 50}

    def __init__(self, episode: int = 200) -> None:
        self._simulation = pliant.Simulation(scene())
        self._start = self._simulation.state
        self._episode = episode
        self._elapsed = 0
        rest = self._simulation.rest_positions
        self._bottom = np.flatnonzero(rest[:, 1] == 0.0)
        # Each muscle pulls two places of the bottom together.
        ends = np.linspace(0, len(self._bottom) - 1, MUSCLES + 1).astype(int)
        self._muscles = [(self._bottom[a], self._bottom[b]) for a, b in zip(ends, ends[1:])]
        self._x, self._v = self._simulation.positions_view, self._simulation.velocities_view
        self.observation_space = gym.spaces.Box(-LARGEST, LARGEST, (2 * rest.size,), np.float32)
        self.action_space = gym.spaces.Box(-1.0, 1.0, (MUSCLES,), np.float32)

    def _observation(self) -> npt.NDArray[np.float32]:
        seen = np.concatenate([(self._x - self._x.mean(axis=0)).ravel(), self._v.ravel()])
        return seen.clip(-LARGEST, LARGEST).astype(np.float32)

    def _forces(self, action: npt.NDArray[np.float32]) -> Array:
        forces = np.zeros_like(self._x)
        for contraction, (a, b) in zip(action, self._muscles):
            along = self._x[b] - self._x[a]
            pull = STRENGTH * float(contraction) * along / max(float(np.linalg.norm(along)), 1e-12)
            forces[a] += pull
            forces[b] -= pull
        speed = self._v[self._bottom, 0]
        grips = self._x[self._bottom, 1] < 1e-4
        forces[self._bottom, 0] -= np.where(speed > 0.0, FORWARDS, BACKWARDS) * speed * grips
        return forces

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[npt.NDArray[np.float32], dict[str, Any]]:
        super().reset(seed=seed)
        self._simulation.state = self._start
        # A little different each time, and the same for the same seed.
        self._simulation.velocities = 1e-3 * self.np_random.standard_normal(self._x.shape)
        self._elapsed = 0
        return self._observation(), {}

    def step(
        self, action: npt.NDArray[np.float32]
    ) -> tuple[npt.NDArray[np.float32], float, bool, bool, dict[str, Any]]:
        before = float(self._x[:, 0].mean())
        # Friction follows the velocities: forces are set a few times in each step of the environment.
        for _ in range(8):
            self._simulation.external_forces = self._forces(0.5 + 0.5 * np.clip(action, -1.0, 1.0))
            self._simulation.step(SUBSTEPS // 8)
        self._elapsed += 1
        progress = float(self._x[:, 0].mean()) - before
        return (
            self._observation(),
            progress,
            False,
            self._elapsed >= self._episode,
            {"time": self._simulation.time},
        )


def wave(step: int) -> npt.NDArray[np.float32]:
    """A contraction that runs from the tail to the head."""
    phase = 2.0 * np.pi * (step / 25.0 - np.arange(MUSCLES) / MUSCLES)
    return np.clip(2.0 * np.sin(phase) - 1.0, -1.0, 1.0).astype(np.float32)


if __name__ == "__main__":
    crawler = Crawler()
    crawler.reset(seed=1)
    distance = sum(crawler.step(wave(step))[1] for step in range(200))
    print(f"{distance:.3f} m in {200 * SUBSTEPS * 5e-4:.1f} s")
