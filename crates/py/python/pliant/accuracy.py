"""Errors of quantities: by mesh, step and solver; against run time; and runs for a wished accuracy."""

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
    """Error of one quantity of a run by mesh, step and solver: what `errors` and `solve` return.

    Attributes
    ----------
    quantity : str
        Name, as it was asked for.
    unit : str
        Unit of all numbers.
    value : float
        Value of the run.
    interval : float or None
        Half-width of the interval about the value that is to hold the truth; None if a part is not known.
    extrapolated : float or None
        Value plus the estimates of the parts; None if a part is not known.
    parts : dict of str to dict
        ``mesh``, ``step`` and ``solver``: ``estimate``, which is a dict with ``estimate``, ``interval``,
        ``order`` and ``tier``, or None; ``expected_order``; ``about``, its origin or the reason for which
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
        What is simulated.
    of : str or sequence of str, optional
        The quantities, for example ``"tip.y"`` or ``"left.force.x mean"``; displacements of all probes at the
        end without it.
    callback : callable, optional
        Called with the number of each run before it begins. What it raises ends the runs.

    Returns
    -------
    dict of str to ErrorBudget
        The errors by the names of the quantities.

    Raises
    ------
    SceneError
        The scene cannot be simulated.
    ValueError
        A quantity is none of the scene; there is none.
    RuntimeError
        The run of the scene does not reach its end.
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
    """Total error against run time, one row for each run: what `refine` returns.

    Attributes
    ----------
    quantities : dict of str to dict
        For each quantity the ``reference`` with its ``value`` and ``uncertainty``, ``ladders`` of values on
        finer and finer meshes, ``cheapest`` rows for a few errors, and the ``front``.
    left_out : list of str
        What was not run, with the reasons.

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
    """Compare meshes, elements, schemes and steps by their total error, as ``pliant study --refine``.

    Parameters
    ----------
    scene : Scene
        What is simulated; its cells are those of the coarsest mesh.
    of : str or sequence of str, optional
        The quantities; displacements of all probes at the end without it.
    levels : int, optional
        Number of meshes, each with twice the cells along every direction of the one before; 3 without it.
    elements : sequence of str, optional
        ``"linear"``, ``"quadratic"``, ``"quadrilateral"``, ``"quadratic-quadrilateral"``, or with
        ``hexahedron`` in 3D; all that the mesh has without it.
    integrators : sequence of str or mapping, optional
        The schemes.
    budget : float, optional
        Wall time for everything [s]; 60 without it.
    threads : int, default 1
        Threads that steps run on.
    callback : callable, optional
        Called with each run in words before it begins. What it raises ends the study.

    Returns
    -------
    Refinement
        A table with references and the cheapest rows.

    Raises
    ------
    SceneError
        The scene cannot be simulated.
    ValueError
        Its meshes cannot be refined; a quantity is none of the scene.
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
    """Run whose error is within a wish: what `solve` returns.

    Attributes
    ----------
    elements : str
        Elements in words.
    cells : str
        Cells, as ``"8x4"``.
    scheme : str
        Name of the scheme.
    step : float or None
        Step [s]; None in statics.
    changes : dict of str to object
        Changes of the scene for `Scene.with_changes`.
    removed : list of str
        Keys that have to be taken out of the scene beside.
    wish : float
        Largest error that was wished for, in the unit of the quantity.
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
    """Find mesh, elements, scheme and step for an accuracy of a quantity, as ``pliant solve``.

    Parameters
    ----------
    scene : Scene
        What is simulated; its mesh, elements, scheme and step are what is searched.
    of : str
        The quantity, for example ``"tip.y"``.
    accuracy : str or float
        Its largest error: ``"1 %"`` or ``0.01`` of its largest magnitude over time, or with a unit,
        ``"0.1 mm"``.
    budget : float, default 300.0
        Wall time of the search [s].
    callback : callable, optional
        Called with each run in words before it begins. What it raises ends the search.

    Returns
    -------
    AccurateRun
        The run, with the proof.

    Raises
    ------
    SceneError
        The scene cannot be simulated.
    ValueError
        Its meshes cannot be refined; there is no such quantity; `accuracy` is none.
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
