"""Errors of quantities by mesh, step and solver, against run time, and runs of a required accuracy."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from ._pliant import Scene, _errors, _refine, _solve
from .tables import Table

Watcher = Callable[[Any], object]


@dataclass(frozen=True)
class ErrorBudget:
    """Error of one quantity of a run by mesh, step and solver; returned by `errors` and `solve`.

    Attributes
    ----------
    quantity : str
        Name of the quantity.
    unit : str
        Unit of all numbers.
    value : float
        Value of the run.
    interval : float or None
        Half-width of the interval around the value that contains the truth; None if a part is unknown.
    extrapolated : float or None
        Value plus the estimates of the parts; None if a part is unknown.
    parts : dict of str to dict
        ``mesh``, ``step`` and ``solver``: ``estimate``, which is a dict with ``estimate``, ``interval``,
        ``order`` and ``tier``, or None; ``expected_order``; ``about``, its origin or the reason why
        there is none.
    """

    quantity: str
    unit: str
    value: float
    interval: float | None
    extrapolated: float | None
    parts: dict[str, dict[str, Any]]


def _budget(found: Mapping[str, Any]) -> ErrorBudget:
    parts = {part["part"]: {key: part[key] for key in part if key != "part"} for part in found["parts"]}
    return ErrorBudget(**{**found, "parts": parts})


def errors(
    scene: Scene, of: str | Sequence[str] = (), *, callback: Watcher | None = None
) -> dict[str, ErrorBudget]:
    """Estimate the errors of a run by mesh, step and solver, as ``pliant run --errors``.

    The parts come from a few runs of the same scene on coarser meshes and with other steps.

    Parameters
    ----------
    scene : Scene
        The scene.
    of : str or sequence of str, optional
        Quantities, for example ``"tip.y"`` or ``"left.force.x mean"``; default: displacements of all probes
        at the end.
    callback : callable, optional
        Called with the number of each run before it begins. An exception ends the runs.

    Returns
    -------
    dict of str to ErrorBudget
        The errors by the names of the quantities.

    Raises
    ------
    SceneError
        The scene cannot be simulated.
    ValueError
        The scene has no such quantity, or no quantity at all.
    RuntimeError
        The run of the scene fails.
    KeyboardInterrupt
        Ctrl-C.

    Examples
    --------
    >>> coarse = Scene.from_toml('''
    ... dimension = 2
    ... time = { integrator = "quasi-static", step = 1, duration = 1 }
    ... world = { gravity = [0, -10] }
    ... [[body]]
    ... mesh = { grid = { cells = [4, 16], size = [0.2, 1] } }
    ... elastic = { linear = { young = 1e6, poisson = 0 } }
    ... mass = { density = 1000 }
    ... pin = [{ half_space = { normal = [0, -1], offset = -1 } }]
    ... [[probe]]
    ... name = "foot"
    ... at = [0.1, 0]
    ... ''')
    >>> foot = errors(coarse, "foot.y")["foot.y"]
    >>> abs(foot.value + 0.005) <= foot.interval + 1e-12
    True
    """
    found = _errors(scene, [of] if isinstance(of, str) else list(of), callback)
    return {quantity["quantity"]: _budget(quantity) for quantity in found["quantities"]}


class Refinement(Table):
    """Total error against run time, one row per run; returned by `refine`.

    Attributes
    ----------
    quantities : dict of str to dict
        For each quantity the ``reference`` with its ``value`` and ``uncertainty``, ``ladders`` of values on
        finer and finer meshes, ``cheapest`` rows for a few errors, and the ``front``.
    left_out : list of str
        Runs that were omitted, with the reasons.

    Notes
    -----
    Columns: ``elements``, ``cells``, ``unknowns``, ``scheme``, ``step`` [s], ``seconds`` [s] of the run, and for
    each quantity its value and ``error of NAME``, relative to its largest magnitude over time.
    """

    def __init__(self, found: dict[str, Any]) -> None:
        rows = found["rows"]
        columns: dict[str, Any] = {"elements": found["elements"]}
        columns |= {
            name: [row[name] for row in rows] for name in ("cells", "unknowns", "scheme", "step", "seconds")
        }
        for i, quantity in enumerate(found["quantities"]):
            columns[quantity["quantity"]] = [row["values"][i] for row in rows]
            totals = [error["total"] for error in quantity["errors"]] or [None] * len(rows)
            columns[f"error of {quantity['quantity']}"] = totals
        units = {"step": "s", "seconds": "s"}
        units |= {quantity["quantity"]: quantity["unit"] for quantity in found["quantities"]}
        super().__init__(columns, units)
        self.quantities = {quantity["quantity"]: quantity for quantity in found["quantities"]}
        self.left_out = list(found["left_out"])


def refine(
    scene: Scene,
    of: str | Sequence[str] = (),
    *,
    levels: int | None = None,
    elements: Sequence[str] | None = None,
    integrators: Sequence[str | Mapping[str, Any]] | None = None,
    budget: float | None = None,
    threads: int = 1,
    callback: Watcher | None = None,
) -> Refinement:
    """Compare meshes, elements, integrators and steps by their total error, as ``pliant study --refine``.

    Parameters
    ----------
    scene : Scene
        The scene; its cells are those of the coarsest mesh.
    of : str or sequence of str, optional
        Quantities; default: displacements of all probes at the end.
    levels : int, optional
        Number of meshes, each with twice the cells along every direction of the one before; default: 3.
    elements : sequence of str, optional
        ``"linear"``, ``"quadratic"``, ``"quadrilateral"``, ``"quadratic-quadrilateral"``, or with
        ``hexahedron`` in 3D; default: all that the mesh supports.
    integrators : sequence of str or mapping, optional
        Integrators.
    budget : float, optional
        Wall time of all runs [s]; default: 60.
    threads : int, default 1
        Number of threads.
    callback : callable, optional
        Called with a description of each run before it begins. An exception ends the study.

    Returns
    -------
    Refinement
        A table with references and the cheapest rows.

    Raises
    ------
    SceneError
        The scene cannot be simulated.
    ValueError
        The meshes cannot be refined; the scene has no such quantity.
    RuntimeError
        No run reached its end.
    KeyboardInterrupt
        Ctrl-C.

    Examples
    --------
    >>> bar = Scene.from_toml('''
    ... dimension = 2
    ... time = { integrator = "quasi-static", step = 1, duration = 1 }
    ... world = { gravity = [0, -10] }
    ... [[body]]
    ... mesh = { grid = { cells = [2, 4], size = [0.5, 1] } }
    ... elastic = { linear = { young = 1e6, poisson = 0.3 } }
    ... mass = { density = 1000 }
    ... pin = [{ half_space = { normal = [0, -1], offset = -1 } }]
    ... [[probe]]
    ... name = "foot"
    ... at = [0.25, 0]
    ... ''')
    >>> found = refine(bar, "foot.y", elements=["linear", "quadratic"])
    >>> found["cells"].tolist()
    ['2x4', '2x4', '4x8', '4x8', '8x16', '8x16']
    >>> found.quantities["foot.y"]["reference"]["agrees"]
    True
    """
    changes: dict[str, Any] = {"study.of": [of] if isinstance(of, str) else list(of)}
    given = {"refine": levels, "elements": elements, "integrators": integrators}
    changes |= {f"study.{key}": value for key, value in given.items() if value is not None}
    return Refinement(_refine(scene, changes, budget, threads, callback))


@dataclass(frozen=True)
class AccurateRun:
    """Run with a required accuracy; returned by `solve`.

    Attributes
    ----------
    elements : str
        Description of the elements.
    cells : str
        Numbers of cells, such as ``"8x4"``.
    scheme : str
        Name of the integrator.
    step : float or None
        Step [s]; None in statics.
    changes : dict of str to object
        Changes of the scene for `Scene.with_changes`.
    removed : list of str
        Keys that must also be removed from the scene.
    wish : float
        Required largest error, in the unit of the quantity.
    proof : ErrorBudget
        The error of the run.
    seconds : float
        Time of the run [s].
    runs : int
        Number of runs of the search.
    search_seconds : float
        Time of the search [s].
    """

    elements: str
    cells: str
    scheme: str
    step: float | None
    changes: dict[str, Any]
    removed: list[str]
    wish: float
    proof: ErrorBudget
    seconds: float
    runs: int
    search_seconds: float


def solve(
    scene: Scene,
    of: str,
    accuracy: str | float,
    *,
    budget: float = 300.0,
    callback: Watcher | None = None,
) -> AccurateRun:
    """Find mesh, elements, integrator and step for the accuracy of a quantity, as ``pliant solve``.

    Parameters
    ----------
    scene : Scene
        The scene; mesh, elements, integrator and step are varied.
    of : str
        Quantity, for example ``"tip.y"``.
    accuracy : str or float
        Largest error: ``"1 %"`` or ``0.01`` of its largest magnitude over time, or with a unit,
        ``"0.1 mm"``.
    budget : float, default 300.0
        Wall time of the search [s].
    callback : callable, optional
        Called with a description of each run before it begins. An exception ends the search.

    Returns
    -------
    AccurateRun
        The run and its proof.

    Raises
    ------
    SceneError
        The scene cannot be simulated.
    ValueError
        The meshes cannot be refined; there is no such quantity; `accuracy` is not valid.
    RuntimeError
        The accuracy was not proved within the budget.
    KeyboardInterrupt
        Ctrl-C.

    Examples
    --------
    >>> bar = Scene.from_toml('''
    ... dimension = 2
    ... time = { integrator = "quasi-static", step = 1, duration = 1 }
    ... world = { gravity = [0, -10] }
    ... [[body]]
    ... mesh = { grid = { cells = [2, 4], size = [0.5, 1] } }
    ... elastic = { linear = { young = 1e6, poisson = 0.3 } }
    ... mass = { density = 1000 }
    ... pin = [{ half_space = { normal = [0, -1], offset = -1 } }]
    ... [[probe]]
    ... name = "foot"
    ... at = [0.25, 0]
    ... ''')
    >>> run = solve(bar, "foot.y", "1 %")
    >>> run.proof.interval <= run.wish
    True
    >>> Simulation(bar.with_changes(run.changes)).run().steps
    1
    """
    found = _solve(scene, of, str(accuracy), budget, callback)
    keys = found["keys"]
    return AccurateRun(
        elements=found["elements"],
        cells=found["cells"],
        scheme=found["scheme"],
        step=found["step"],
        changes={key["path"]: _value(key["value"]) for key in keys if key["value"] is not None},
        removed=[key["path"] for key in keys if key["value"] is None],
        wish=found["wish"],
        proof=_budget(found["proof"]),
        seconds=found["seconds"],
        runs=found["runs"],
        search_seconds=found["search_seconds"],
    )


def _value(text: str) -> Any:
    """A number or a list of numbers; a word as it is."""
    try:
        return json.loads(text)
    except json.JSONDecodeError:
        return text
