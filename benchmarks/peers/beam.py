"""The beam that falls: one body, mesh and answer for the programs that move in time.

A cantilever of tetrahedra at rest, clamped at x = 0, undamped, is let go under its weight. Its converged
answer is that of SciPy's DOP853 with the forces written below in NumPy: it owes nothing to any program that
is compared.
"""

from __future__ import annotations

from common import Case  # isort: skip

from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np
import pliant
from mesh import bar
from scipy.integrate import solve_ivp

CELLS, SIZE = (20, 5, 5), (0.6, 0.15, 0.15)
YOUNG, POISSON, DENSITY, GRAVITY = 1e6, 0.3, 1000.0, 9.81
MU, LAMBDA = YOUNG / (2 * (1 + POISSON)), YOUNG * POISSON / ((1 + POISSON) * (1 - 2 * POISSON))
DURATION = 0.2
MESH = bar(CELLS, SIZE, "tetra")
POINTS, TETRAHEDRA = MESH.points, MESH.cells[0].data
FREE = POINTS[:, 0] > 1e-9
TITLE = f"A falling beam of {len(TETRAHEDRA)} tetrahedra, {DURATION:g} s"


def masses(equal: bool) -> np.ndarray:
    """Of the vertices [kg]: all equal, or a quarter of each tetrahedron to each of its corners."""
    if equal:
        return np.full(len(POINTS), DENSITY * np.prod(SIZE) / len(POINTS))
    volume = np.linalg.det(POINTS[TETRAHEDRA[:, 1:]] - POINTS[TETRAHEDRA[:, :1]]) / 6
    return np.bincount(TETRAHEDRA.ravel(), np.repeat(DENSITY * volume / 4, 4), len(POINTS))


def stvk(f: np.ndarray) -> np.ndarray:
    """First Piola-Kirchhoff stress of St. Venant-Kirchhoff."""
    strain = (f.swapaxes(1, 2) @ f - np.eye(3)) / 2
    return f @ (2 * MU * strain + LAMBDA * np.trace(strain, axis1=1, axis2=2)[:, None, None] * np.eye(3))


def cofactor(f: np.ndarray) -> np.ndarray:
    columns = f.swapaxes(1, 2)
    return np.stack([np.cross(columns[:, (i + 1) % 3], columns[:, (i + 2) % 3]) for i in range(3)], axis=2)


def stable_neo_hookean(f: np.ndarray) -> np.ndarray:
    """That of Smith, de Goes, Kim 2018 without the logarithm, as pliant and Newton's VBD have it."""
    c = cofactor(f)
    j = (f[:, :, 0] * c[:, :, 0]).sum(axis=1)[:, None, None]
    return MU * f + ((LAMBDA + MU) * (j - 1) - MU) * c


LOG_MU, LOG_LAMBDA = 4 * MU / 3, LAMBDA + 5 * MU / 6
"""Constants of the form with the logarithm that have the same moduli at rest."""


def stable_neo_hookean_log(f: np.ndarray) -> np.ndarray:
    """That of Smith, de Goes, Kim 2018 with the logarithm, as pliant and SolverSemiImplicit have it."""
    c = cofactor(f)
    j = (f[:, :, 0] * c[:, :, 0]).sum(axis=1)[:, None, None]
    squares = (f * f).sum(axis=(1, 2))[:, None, None]
    alpha = 1 + LOG_MU / LOG_LAMBDA - LOG_MU / (4 * LOG_LAMBDA)
    return LOG_MU * (1 - 1 / (squares + 1)) * f + LOG_LAMBDA * (j - alpha) * c


STRESS = {
    "stvk": stvk,
    "stable-neo-hookean": stable_neo_hookean,
    "stable-neo-hookean-log": stable_neo_hookean_log,
}


def converged(material: str, equal: bool) -> np.ndarray:
    """Positions at the end, by SciPy."""
    edges = (POINTS[TETRAHEDRA[:, 1:]] - POINTS[TETRAHEDRA[:, :1]]).swapaxes(1, 2)
    inverse, volume = np.linalg.inv(edges), np.linalg.det(edges) / 6
    mass, count = masses(equal)[:, None], len(POINTS)

    def acceleration(x: np.ndarray) -> np.ndarray:
        now = (x[TETRAHEDRA[:, 1:]] - x[TETRAHEDRA[:, :1]]).swapaxes(1, 2)
        on = -volume[:, None, None] * (STRESS[material](now @ inverse) @ inverse.swapaxes(1, 2))
        parts = np.concatenate([-on.sum(axis=2)[:, :, None], on], axis=2).swapaxes(1, 2).reshape(-1, 3)
        force = np.stack([np.bincount(TETRAHEDRA.ravel(), parts[:, k], count) for k in range(3)], axis=1)
        return np.where(FREE[:, None], force / mass - [0.0, 0.0, GRAVITY], 0.0)

    def rate(_: float, state: np.ndarray) -> np.ndarray:
        x, v = state.reshape(2, count, 3)
        return np.concatenate([v, acceleration(x)]).ravel()

    start = np.concatenate([POINTS, np.zeros_like(POINTS)]).ravel()
    found = solve_ivp(rate, (0.0, DURATION), start, "DOP853", rtol=1e-11, atol=1e-12)
    return found.y[:, -1].reshape(2, count, 3)[0]


def error_of(exact: np.ndarray) -> Callable[[Case], float]:
    """The largest error of a coordinate beside the largest displacement."""
    size = np.abs(exact - POINTS).max()
    return lambda case: float(np.abs(case.answer - exact).max() / size)


def simulation(
    material: str, equal: bool, time: dict[str, object], mesh: Path | None = None
) -> pliant.Simulation:
    """The beam in pliant, from a file or from arrays."""
    inline = {"inline": {"points": POINTS, "tetrahedra": TETRAHEDRA}}
    return pliant.Simulation(
        pliant.Scene(
            dimension=3,
            time={"duration": DURATION, **time},
            world={"gravity": [0, 0, -GRAVITY]},
            body=[
                {
                    "mesh": {"file": {"path": str(mesh)}} if mesh else inline,
                    "elastic": {material: {"young": YOUNG, "poisson": POISSON}},
                    "mass": {"per_vertex": masses(equal)},
                    "pin": [{"half_space": {"normal": [1, 0, 0], "offset": 0}}],
                }
            ],
            output={"rate": 1.0 / DURATION, "channels": ["state"]},
        )
    )


def with_pliant(
    material: str, equal: bool, scheme: str, steps: int, mesh: Path | None = None, **solver: object
) -> Case:
    """A case of pliant in equal steps."""

    def prepare() -> tuple[Callable[[], object], Callable[[], np.ndarray]]:
        time = {"integrator": scheme, "step": DURATION / steps, **({"solver": solver} if solver else {})}
        made = simulation(material, equal, time, mesh)
        return partial(made.step, steps), lambda: np.array(made.positions)

    more = [f"{key} {value}" for key, value in solver.items()]
    return Case("pliant", ", ".join([scheme, f"{steps} steps", *more]), prepare)


def describe(exact: np.ndarray, material: str, equal: bool) -> None:
    """Print how far it falls, and how far apart SciPy and pliant in small steps are."""
    check = with_pliant(material, equal, "yoshida4", 8000)
    check.run()
    apart = error_of(exact)(check) if not check.failed else check.failed
    sinks = (POINTS - exact)[np.isclose(POINTS[:, 0], SIZE[0]), 2].mean()
    print(
        f"\n{material}: {len(TETRAHEDRA)} tetrahedra, {len(POINTS)} vertices; the end sinks by {sinks:.6f} m"
    )
    print(f"in {DURATION:g} s. pliant's yoshida4 in 8000 steps is {apart:.1e} from the converged answer.")


def compare(one: Case, other: Case, exact: np.ndarray, steps: int) -> None:
    """Print how far apart two programs are by the same scheme in the same steps; neither may fail."""
    one.run()
    other.run()
    if one.failed or other.failed:
        raise SystemExit(one.failed or other.failed)
    apart = np.abs(one.answer - other.answer).max() / np.abs(exact - POINTS).max()
    print(f"The same scheme in the same {steps} steps differs between the two by {apart:.1e}.")
