"""A crawler that learns by gradient, beside its learning without.

    python learning_crawler.py

A worm of rubber lies on the ground. Six muscles along its belly contract and relax twice a second, each at
a time of its own. At times at random it wriggles on the spot; it gets on if a wave runs through it, and that
is learned: the phases of the six muscles, from how far it gets in a second.

Once by gradient: a run and its way back say at once how the distance changes with all phases, contact and
friction included. And once without, by steps at random that are kept where they get farther. A gradient is
counted as two runs; both ways have as many.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt
import pliant

Array = npt.NDArray[np.float64]

MUSCLES = 6
LENGTH, HEIGHT = 0.4, 0.02
#: Steps of a hundredth of a second.
STEPS = 100
#: Contractions per second, and largest tension [Pa].
RATE, TENSION = 2.0, 4e4
#: That learning may take.
RUNS = 24


def muscle(number: int, phase: float) -> dict[str, object]:
    """A muscle in the lower half of its part of the worm."""
    begin, end = (LENGTH * (number + i) / MUSCLES for i in range(2))
    part = f"(X > {begin!r})*(X < {end!r})*(Y < {HEIGHT / 2!r})"
    pull = f"A*(0.5 - 0.5*cos({2 * math.pi * RATE!r}*t - phase))*smoothstep(0, 0.25, t)"
    return {
        "fibre": {"direction": [1, 0]},
        "tension": f"{pull}*{part} where A = {TENSION!r}, phase = {phase!r}",
    }


def scene(phases: Array) -> pliant.Scene:
    """The worm, head to the right."""
    return pliant.Scene(
        dimension=2,
        time={"integrator": "implicit-euler", "step": 0.01, "duration": 0.01 * STEPS},
        world={"gravity": [0, -9.81]},
        contact={"distance": 1e-3, "stiffness": 2e4, "friction": 0.6},
        obstacle=[{"name": "ground", "shape": {"half_space": {"normal": [0, 1], "offset": -1e-3}}}],
        body=[
            {
                "name": "worm",
                "mesh": {"grid": {"cells": [24, 2], "size": [LENGTH, HEIGHT]}},
                "elastic": {"neo-hookean": {"young": 3e4, "poisson": 0.4}},
                "mass": {"density": 1000},
                "muscle": [muscle(i, float(phase)) for i, phase in enumerate(phases)],
            }
        ],
    )


def distance(phases: Array) -> float:
    """How far it gets [m]: one run."""
    simulation = pliant.Simulation(scene(phases))
    start = simulation.positions[:, 0].mean()
    simulation.step(STEPS)
    return float(simulation.positions[:, 0].mean() - start)


def distance_and_slopes(phases: Array) -> tuple[float, Array]:
    """The same, and its derivatives by the phases [m/rad]: a run forwards and one backwards."""
    simulation = pliant.Simulation(scene(phases))
    start = simulation.positions[:, 0].mean()

    def end(frame: pliant.Frame) -> tuple[float, Array] | None:
        if frame.index < STEPS:
            return None
        by = np.zeros_like(frame.positions)
        by[:, 0] = 1.0 / len(by)
        return float(frame.positions[:, 0].mean() - start), by

    names = [f"body.worm.muscle.{i}.parameters.phase" for i in range(MUSCLES)]
    found = simulation.gradient(end, names, steps=STEPS)
    return found.value, np.array([found[name] for name in names])


def first_phases(seed: int) -> Array:
    """Phases at random that both ways of learning start with [rad]: the worm hardly moves."""
    return np.random.default_rng(seed).uniform(-1.0, 1.0, MUSCLES)


def learn_by_gradient(seed: int = 1, runs: int = RUNS) -> tuple[Array, list[float]]:
    """The best phases [rad], and the best distance after each run [m].

    Uphill, in steps that grow while they get farther and shrink where they do not.
    """
    best, step = first_phases(seed), 0.8
    farthest, slopes = distance_and_slopes(best)
    history = [farthest] * 2
    while len(history) < runs:
        phases = best + step * slopes / np.linalg.norm(slopes)
        reached, new_slopes = distance_and_slopes(phases)
        if reached > farthest:
            best, farthest, slopes, step = phases, reached, new_slopes, 1.5 * step
        else:
            step *= 0.4
        history += [farthest] * 2
    return best, history


def learn_by_chance(seed: int = 1, runs: int = RUNS) -> tuple[Array, list[float]]:
    """The same by steps at random, of a size that follows how often they get farther.

    An evolution strategy of one parent and one child, Rechenberg's: with one success in five the size stays.
    """
    random = np.random.default_rng([seed, 1])
    best, step = first_phases(seed), 0.8
    history = [distance(best)]
    while len(history) < runs:
        phases = best + step * random.standard_normal(MUSCLES)
        reached = distance(phases)
        if reached > history[-1]:
            best, step = phases, 1.5 * step
        else:
            step *= 1.5**-0.25
        history.append(max(reached, history[-1]))
    return best, history


if __name__ == "__main__":
    print("best distance [cm] from three starts, by gradient and by chance")
    print("runs " + "     gradient  chance" * 3)
    seeds = (1, 2, 3)
    learned = [learn_by_gradient(seed) for seed in seeds]
    tried = [learn_by_chance(seed) for seed in seeds]
    for run in range(3, RUNS, 4):
        pairs = [
            f"{100 * one[1][run]:13.2f} {100 * other[1][run]:7.2f}" for one, other in zip(learned, tried)
        ]
        print(f"{run + 1:4} " + "".join(pairs))
    phases = max(learned, key=lambda one: one[1][-1])[0]
    print("phases of the best, from the tail to the head [rad]:", np.round(phases - phases[0], 2))
