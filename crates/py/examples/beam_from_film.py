"""Young's modulus and Poisson's ratio of a beam from a film of its tip, by gradients.

    python beam_from_film.py

The film is of the program itself: a beam that is let go and swings. Gauss and Newton's steps take the
derivatives of every coordinate of the film; `pliant fit` does the same from the command line, for tables of
measurements, by differences of runs.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pliant

Array = npt.NDArray[np.float64]

STEPS, EVERY = 60, 10
NAMES = ["body.beam.elastic.young", "body.beam.elastic.poisson"]


def beam(young: float, poisson: float) -> pliant.Simulation:
    """The beam at rest, held at its left."""
    scene = pliant.Scene(
        dimension=2,
        time={"integrator": "implicit-euler", "step": 1e-2, "duration": 0.6, "solver": {"tolerance": 1e-13}},
        world={"gravity": [0.0, -9.81]},
        body=[
            {
                "name": "beam",
                "mesh": {"grid": {"cells": [6, 2], "size": [0.6, 0.2]}},
                "elastic": {"neo-hookean": {"young": young, "poisson": poisson}},
                "mass": {"density": 1000.0},
                "pin": [{"half_space": {"normal": [1, 0], "offset": 0}}],
            }
        ],
    )
    return pliant.Simulation(scene)


def film(young: float, poisson: float) -> Array:
    """Positions of the tip in every tenth frame [m], by rows."""
    simulation, rows = beam(young, poisson), []
    for _ in range(STEPS // EVERY):
        simulation.step(EVERY)
        rows.append(simulation.positions[-1])
    return np.array(rows)


def derivatives(young: float, poisson: float) -> Array:
    """Of every coordinate of the film by both constants: rows of coordinates."""
    rows = []
    for step in range(EVERY, STEPS + 1, EVERY):
        for axis in range(2):

            def coordinate(
                frame: pliant.Frame, step: int = step, axis: int = axis
            ) -> tuple[float, Array] | None:
                if frame.index != step:
                    return None
                by = np.zeros_like(frame.positions)
                by[-1, axis] = 1.0
                return float(frame.positions[-1, axis]), by

            gradient = beam(young, poisson).gradient(coordinate, NAMES, steps=step)
            rows.append([float(gradient[name]) for name in NAMES])
    return np.array(rows)


def identify(filmed: Array, constants: Array, steps: int = 6) -> Array:
    """Young's modulus [Pa] and Poisson's ratio that give this film, from others."""
    for _ in range(steps):
        residual = (film(*constants) - filmed).ravel()
        jacobian = derivatives(*constants) * constants
        constants = constants * (1.0 - np.linalg.lstsq(jacobian, residual, rcond=None)[0])
    return constants


if __name__ == "__main__":
    young, poisson = identify(film(5e4, 0.35), np.array([7e4, 0.25]))
    print(f"E = {young:.3f} Pa, nu = {poisson:.6f}")
