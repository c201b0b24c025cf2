"""Equilibria, beside felupe: a cantilever of tetrahedra, and a nearly incompressible one of hexahedra.

Both read the same mesh file and are loaded by the same forces on the vertices of the end. Each program is
measured against the other's answer at a tight tolerance.
"""

from __future__ import annotations

from common import Case, measure, report  # isort: skip

import tempfile
from collections.abc import Callable
from functools import partial
from pathlib import Path

import felupe
import numpy as np
import pliant
from mesh import bar, write
from scipy.sparse.linalg import splu, spsolve

try:
    from pypardiso import spsolve as pardiso
except (ImportError, OSError):
    pardiso = None

Prepared = tuple[Callable[[], object], Callable[[], np.ndarray]]
LENGTH = 1.0


def ordered(matrix: object, right: np.ndarray) -> np.ndarray:
    """SuperLU with an ordering for symmetric patterns, which fills in less than the default."""
    options = {"SymmetricMode": True}
    return splu(matrix.tocsc(), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options=options).solve(
        right
    )


SOLVERS = {"SuperLU": spsolve, "SuperLU, MMD": ordered, **({"PARDISO": pardiso} if pardiso else {})}


def with_felupe(
    path: Path, moduli: tuple[float, float], force: float, increments: int, solver: str, tolerance: float
) -> Case:
    """A case of felupe: Newton's method in equal increments of the load."""

    def prepare() -> Prepared:
        young, poisson = moduli
        mu, lam = young / (2 * (1 + poisson)), young * poisson / ((1 + poisson) * (1 - 2 * poisson))
        mesh = felupe.mesh.read(path)[0]
        if mesh.cell_type == "tetra":
            field = felupe.FieldContainer([felupe.Field(felupe.RegionTetra(mesh), dim=3)])
            solid = felupe.SolidBody(felupe.NeoHookeCompressible(mu=mu, lmbda=lam), field)
        else:
            field = felupe.FieldContainer([felupe.Field(felupe.RegionHexahedron(mesh), dim=3)])
            solid = felupe.SolidBodyNearlyIncompressible(felupe.NeoHooke(mu=mu), field, bulk=lam + 2 * mu / 3)
        # Points of files are compared with a tolerance.
        clamped = {"left": felupe.Boundary(field[0], fx=lambda x: np.isclose(x, 0.0))}
        dof0, dof1 = felupe.dof.partition(field, clamped)
        end = np.flatnonzero(np.isclose(mesh.points[:, 0], LENGTH))
        load = felupe.PointLoad(field, end)
        each = force / len(end)

        def work() -> None:
            iterations = 0
            for number in range(1, increments + 1):
                load.update(np.array([0.0, 0.0, -each * number / increments]))
                found = felupe.newtonraphson(
                    items=[solid, load],
                    dof0=dof0,
                    dof1=dof1,
                    ext0=np.zeros(len(dof0)),
                    solver=SOLVERS[solver],
                    tol=tolerance,
                    maxiter=50,
                    verbose=0,
                )
                iterations += found.iterations
            case.work = f"Newton {iterations}"

        return work, lambda: field[0].values.copy()

    case = Case("felupe", f"{solver}, {increments} inc., tol {tolerance:g}", prepare)
    return case


def with_pliant(
    path: Path, moduli: tuple[float, float], force: float, increments: int, solver: str, tolerance: float
) -> Case:
    """A case of pliant: the quasi-static scheme in equal increments of the load."""

    def prepare() -> Prepared:
        kind = "neo-hookean" if "tetra" in path.name else "isochoric-neo-hookean"
        scene = pliant.Scene(
            dimension=3,
            time={
                "integrator": "quasi-static",
                "step": 1.0 / increments,
                "duration": 1.0,
                "solver": {"tolerance": tolerance, "linear": solver},
            },
            body=[
                {
                    "mesh": {"file": {"path": str(path)}},
                    "elastic": {kind: {"young": moduli[0], "poisson": moduli[1]}},
                    "mass": {"density": 1000.0},
                    "pin": [{"half_space": {"normal": [1, 0, 0], "offset": 0}}],
                    "load": [
                        {
                            "half_space": {"normal": [-1, 0, 0], "offset": -LENGTH},
                            "force": ["0", "0", f"-{force} * t"],
                        }
                    ],
                }
            ],
            output={"rate": 1.0, "channels": ["state"]},
        )
        simulation = pliant.Simulation(scene)
        rest = np.array(simulation.positions)

        def answer() -> np.ndarray:
            done = simulation.work["solver"]
            case.work = f"Newton {done['newton_iterations']}"
            return np.array(simulation.positions) - rest

        return partial(simulation.step, increments), answer

    case = Case("pliant", f"{solver}, {increments} inc., tol {tolerance:g} m", prepare)
    return case


def compare(
    title: str, path: Path, moduli: tuple[float, float], force: float, tight: float, solvers: list[str]
) -> None:
    """Both programs at several increments, linear solvers and tolerances.

    ``tight`` is felupe's tolerance for the answer, ``solvers`` those of pliant.
    """
    exact = {}
    for case in (
        with_felupe(path, moduli, force, 4, "SuperLU, MMD", tight),
        with_pliant(path, moduli, force, 4, "cholesky", 1e-13),
    ):
        case.run()
        if case.failed:
            raise SystemExit(f"{case.program} has no converged answer: {case.failed}")
        exact[case.program] = case.answer
    size = np.abs(exact["felupe"]).max()

    def distance(one: np.ndarray, other: np.ndarray) -> float:
        return float(np.abs(one - other).max() / size)

    mesh = felupe.mesh.read(path)[0]
    end = np.isclose(mesh.points[:, 0], LENGTH)
    sinks = -exact["felupe"][end, 2].mean()
    apart = distance(exact["felupe"], exact["pliant"])
    counts = f"{mesh.ncells} cells, {mesh.npoints} points"
    print(f"\n{title}: {counts}; the end sinks by {sinks:.6f} m of {LENGTH} m;")
    print(f"the two converged answers differ by {apart:.1e} of the largest displacement.")

    def error(case: Case) -> float:
        other = "pliant" if case.program == "felupe" else "felupe"
        # Elements that are not the same have answers of their own.
        return distance(case.answer, exact[other if apart < 1e-9 else case.program])

    cases = []
    best = list(SOLVERS)[-1]
    for count in (1, 4):
        # Its own solver and tolerance, and those that are faster.
        for solver in SOLVERS if count == 1 else [best]:
            for tolerance in (1e-2, 1e-5, 1.5e-8) if solver == best else (1.5e-8,):
                cases.append(with_felupe(path, moduli, force, count, solver, tolerance))
        for solver in solvers:
            for tolerance in (1e-3, 1e-6, 1e-9):
                cases.append(with_pliant(path, moduli, force, count, solver, tolerance))
    measure(cases, error)
    report(title, cases, [1e-2, 1e-4, 1e-6, 1e-8])


if __name__ == "__main__":
    print(f"\n## Beside felupe {felupe.__version__}")
    with tempfile.TemporaryDirectory() as folder:
        for cells in ((20, 4, 4), (30, 6, 6)):
            path = write(bar(cells, (LENGTH, 0.2, 0.2), "tetra"), Path(folder) / f"tetra{cells[0]}.vtu")
            title, both = f"Cantilever, {6 * np.prod(cells)} tetrahedra", ["cholesky", "multigrid"]
            compare(title, path, (1e6, 0.3), 200.0, 1e-11, both)
        # Cubes: of longer cells pliant takes slopes elsewhere, so that they bend, which is another element.
        cells = (20, 4, 4)
        path = write(bar(cells, (LENGTH, 0.2, 0.2), "hexahedron"), Path(folder) / "hexahedra.vtu")
        # A tighter tolerance than 1e-9 is not reached here.
        title = f"Cantilever, {np.prod(cells)} hexahedra, nu = 0.499"
        compare(title, path, (1e6, 0.499), 200.0, 1e-9, ["cholesky"])
