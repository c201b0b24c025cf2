"""Reports of the commands ``study``, ``stress`` and ``stability``, as tables."""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from os import PathLike
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
import numpy.typing as npt

from ._pliant import Scene, _columns, _stability, _stress, _study
from .tables import Table, axes_or_new

if TYPE_CHECKING:
    from matplotlib.axes import Axes as _Axes

Array = npt.NDArray[Any]
Watcher = Callable[[dict[str, Any]], object]

#: Colours of the kinds of failure.
_COLOURS = {
    "ok": "#9bd4b5",
    "pass": "#9bd4b5",
    "flagged": "#e6c84f",
    "unsolved": "#e69f00",
    "diverged": "#d55e00",
    "fail": "#d55e00",
}


def _watching(
    progress: bool, callback: Watcher | None, line: Callable[[dict[str, Any]], str]
) -> Watcher | None:
    """Return the observer of results: a line on standard error, the function of the user, or None."""
    if not progress:
        return callback

    def show(found: dict[str, Any]) -> None:
        print(line(found), file=sys.stderr)
        if callback is not None:
            callback(found)

    return show


class Study(Table):
    """Error against run time, one row per run; returned by `study`.

    Columns are those of ``rows.csv`` of ``pliant study``.

    Attributes
    ----------
    name : str
        Name of the scene.
    title : str
        Title of the scene.
    lines : Table
        One row per integrator: ``variant``, ``integrator``, ``order_nominal``, ``order_observed``, ``stop``,
        the reason to end its refinement.
    front : Table
        Pareto front: runs that no other run beats in both error and time: ``variant``, ``integrator``,
        ``dt``, ``error``, ``wall_min_s``.
    references : list of dict
        Reference of each variant: ``variant``, ``id``, ``how``, ``error``, ``disagreement``, the distance of
        a second integrator, or None.
    recommendations : dict of str to str
        Settings for the scene that keep the allowed error, as TOML, by the varied value of the scene:
        ``path=value``, empty for the unchanged scene. Variants with the same reference, which only differ in
        the solution method, are compared.
    recommendation : str
        All recommendations, joined.
    provenance : dict of str to str
        Machine and versions.

    Notes
    -----
    Columns:
    """

    def __init__(self, found: dict[str, Any]) -> None:
        variants = found["variants"]
        self._records = [record for variant in variants for record in variant["rows"]]
        rows = [record["row"] for record in self._records]
        shown = [
            "integrator",
            "dt",
            "tol",
            "err_q_rms",
            "obs_order",
            "err_energy_max",
            "n_force",
            "wall_min_s",
            "status",
        ]
        super().__init__(
            {name: [row[name] for row in rows] for name in found["columns"]},
            descriptions=_columns("study"),
            shown=shown,
        )
        self.name: str = found["name"]
        self.title: str = found["title"]
        self.recommendations: dict[str, str] = {
            item["problem"]: item["settings"] for item in found["recommendations"]
        }
        self.recommendation: str = "\n".join(self.recommendations.values())
        self.provenance: dict[str, str] = found["provenance"]
        self.references: list[dict[str, Any]] = [
            {"variant": variant["variant"], **variant["reference"]} for variant in variants
        ]
        self.lines = self._listed(
            variants, "lines", ["integrator", "order_nominal", "order_observed", "stop"]
        )
        self.front = self._listed(variants, "front", ["integrator", "dt", "error", "wall_min_s"])

    def _listed(self, variants: list[dict[str, Any]], key: str, names: list[str]) -> Table:
        rows = [{"variant": variant["variant"], **row} for variant in variants for row in variant[key]]
        units = {name: unit for name, unit in self.units.items() if name in names}
        return Table({name: [row[name] for row in rows] for name in ["variant", *names]}, units)

    def errors(self, row: int) -> Table:
        """List the errors of a run at each time of comparison that it reached.

        Parameters
        ----------
        row : int
            Row of the run.

        Returns
        -------
        Table
            ``time`` [s], ``q_rms`` and ``q_max`` [m], ``v_rms`` [m/s].

        Examples
        --------
        >>> short = scene.with_changes({"time.duration": 0.01})
        >>> found = study(short, integrators=["rk4"], steps=[1e-3])
        >>> list(found.errors(0))
        ['time', 'q_rms', 'q_max', 'v_rms']
        """
        errors = self._records[row]["errors"]
        units = {"time": "s", "q_rms": "m", "q_max": "m", "v_rms": "m/s"}
        return Table({name: [error[name] for error in errors] for name in units}, units)

    def energy(self, row: int) -> Table:
        """Return the change of energy of a run, relative to its energy scale.

        Parameters
        ----------
        row : int
            Row of the run.

        Returns
        -------
        Table
            ``time`` [s] and ``energy``.

        Examples
        --------
        >>> short = scene.with_changes({"time.duration": 0.01})
        >>> found = study(short, integrators=["rk4"], steps=[1e-3])
        >>> bool(abs(found.energy(0)["energy"]).max() < 0.1)
        True
        """
        record = self._records[row]
        return Table({"time": record["times"], "energy": record["energy"]}, {"time": "s"})

    def plot(
        self,
        against: Literal["time", "step"] = "time",
        *,
        variant: str | None = None,
        axes: _Axes | None = None,
    ) -> _Axes:
        """Plot error against run time or step, one line per integrator, with matplotlib.

        Parameters
        ----------
        against : {"time", "step"}
            Horizontal axis: the shortest of the timed runs, or the step.
        variant : str, optional
            A value of the column ``variant``; default: the first.
        axes : matplotlib.axes.Axes, optional
            Axes to draw into; default: new ones.

        Returns
        -------
        matplotlib.axes.Axes
            The axes; failed runs are crosses at the top.

        Examples
        --------
        >>> short = scene.with_changes({"time.duration": 0.01})
        >>> axes = study(short, integrators=["rk4"], steps=[1e-3, 5e-4]).plot("step")
        >>> axes.get_xlabel()
        'step [s]'
        """
        columns = {"time": "wall_min_s", "step": "dt"}
        if against not in columns:
            raise ValueError(f'against is "time" or "step", got {against!r}')
        reference = next((one for one in self.references if variant in (None, one["variant"])), None)
        if reference is None:
            names = [one["variant"] for one in self.references]
            raise ValueError(f"there is no variant {variant!r}; there are {names}")
        axes = axes_or_new(axes)
        here, x, error = self["variant"] == reference["variant"], self[columns[against]], self["err_q_rms"]
        adaptive = ~np.isnan(self["tol"])
        for scheme in dict.fromkeys(self["integrator"].tolist()):
            for follows in (False, True):
                line = here & (self["integrator"] == scheme) & (adaptive == follows)
                counts, failed = (
                    line & (self["status"] == "ok") & ~self["dropped"],
                    line & (self["status"] != "ok"),
                )
                if counts.any():
                    name = f"{scheme} (adaptive)" if follows else scheme
                    [drawn] = axes.plot(x[counts], error[counts], ".-", label=name)
                    colour = drawn.get_color()
                else:
                    colour = "0.5"
                if failed.any():
                    top = np.full(int(failed.sum()), 0.98)
                    axes.plot(x[failed], top, "x", color=colour, transform=axes.get_xaxis_transform())
        axes.axhline(
            10.0 * reference["error"],
            color="0.7",
            linestyle=":",
            label="ten times the error of the reference",
        )
        labels = {"time": "run time [s]", "step": "step [s]"}
        axes.set(
            xscale="log", yscale="log", xlabel=labels[against], ylabel="error of positions", title=self.title
        )
        axes.legend()
        return axes


def study(
    scene: Scene,
    *,
    integrators: Sequence[str | Mapping[str, Any]] | None = None,
    steps: Sequence[float | str] | None = None,
    tolerances: Sequence[float] | None = None,
    vary: Mapping[str, Sequence[Any]] | None = None,
    times: int | None = None,
    error: float | None = None,
    reference: Literal["auto", "exact", "computed"] = "auto",
    repeats: int | None = None,
    threads: int = 1,
    budget: float | None = None,
    folder: str | PathLike[str] | None = None,
    report: str | PathLike[str] | None = None,
    progress: bool = False,
    callback: Watcher | None = None,
) -> Study:
    """Compare integrators and steps on a scene, as ``pliant study``.

    The result is the error against run time, relative to a reference with a known error.

    Each error is an error in time, on this mesh. Defaults come from ``[study]`` of the scene.

    Parameters
    ----------
    scene : Scene
        The scene.
    integrators : sequence of str or mapping, optional
        Integrators, as in a scene, in addition to the scene's own; default: a dozen.
    steps : sequence of float or str, optional
        Steps [s]; default: halved until errors no longer fall.
    tolerances : sequence of float, optional
        Tolerances of adaptive integrators; default: chosen by factors of 10 if no steps are given either.
    vary : mapping of str to sequence, optional
        Values to vary as well, ``{"body.0.elastic.neo-hookean.young": [1e5, 1e6]}``: all combinations.
    times : int, optional
        Number of times at which states are compared, at least 20.
    error : float, optional
        Largest relative error of the recommendation; default: 0.01.
    reference : {"auto", "exact", "computed"}
        Origin of the reference.
    repeats : int, optional
        Timed runs per row; default: 7, or as many as take a second.
    threads : int, default 1
        Number of threads.
    budget : float, optional
        Wall time of all runs [s]; default: 60 if steps are not given.
    folder : str or os.PathLike, optional
        Folder for references and finished rows: the same call, or ``pliant study -o``, continues from there.
    report : str or os.PathLike, optional
        HTML page to write, with charts.
    progress : bool, default False
        True to show each row on standard error.
    callback : callable, optional
        Called with each finished row, a dictionary of the columns. An exception ends the study.

    Returns
    -------
    Study
        Table with plots. Failed runs are rows of it.

    Raises
    ------
    SceneError
        The scene, or a variant of it, cannot be simulated; there is no such integrator.
    ValueError
        Nothing moves, or the scene is quasi-static; no exact reference is known.
    RuntimeError
        No reference was found within the time budget.
    KeyboardInterrupt
        Ctrl-C.

    Examples
    --------
    >>> short = scene.with_changes({"time.duration": 0.01})
    >>> found = study(short, integrators=["velocity-verlet", "rk4"], steps=[1e-3])
    >>> str(found["integrator"][found["err_q_rms"].argmin()])
    'rk4'
    """
    given = {
        "integrators": integrators,
        "steps": steps,
        "tolerances": tolerances,
        "times": times,
        "error": error,
    }
    changes = {f"study.{key}": value for key, value in given.items() if value is not None}
    for name, number in (("repeats", repeats), ("threads", threads)):
        if number is not None and number < 1:
            raise ValueError(f"{name} must be 1 or more, got {number}")
    if budget is not None and not 0.0 < budget < float("inf"):
        raise ValueError(f"budget must be a positive time, got {budget}")
    options = {
        "reference": reference,
        "repeats": repeats,
        "threads": threads,
        "budget": budget,
        "folder": folder,
        "report": report,
    }
    watch = _watching(progress, callback, _row_line)
    return Study(_study(scene, changes, None if vary is None else dict(vary), options, watch))


def _row_line(row: dict[str, Any]) -> str:
    result = (
        row["status"]
        if row["err_q_rms"] is None
        else f"error {row['err_q_rms']:.2e} in {row['wall_min_s']:.2e} s"
    )
    return f"{row['integrator']}, step {row['dt']:.4g} s: {result}"


class Stress(Table):
    """Results of robustness tests, one row per case; returned by `stress`.

    Columns are those of ``stress.csv`` of ``pliant stress``.

    Attributes
    ----------
    counts : dict of str to int
        Numbers of cases: ``pass``, ``flagged`` and ``fail``.
    pictures : list of dict or None
        End states of cases that have one: ``positions``, of shape (n, dim) [m], ``triangles``, of shape (m,
        3), elements in 2D and faces in 3D, and ``J``, of shape (m,), ``det F`` of each element; empty in 3D.

    Notes
    -----
    Columns: ``row``, ``name``, ``dimension``, ``material``, ``poisson``, ``integrator`` and ``solver`` say
    what the case is, and
    """

    def __init__(self, cases: list[dict[str, Any]], pictures: list[dict[str, Array] | None]) -> None:
        names = [
            "row",
            "name",
            "dimension",
            "material",
            "poisson",
            "integrator",
            "solver",
            "verdict",
            "iterations",
            "bar",
        ]
        names += ["step_size", "min_j", "energy_ratio", "error", "tolerance", "seconds", "notes", "advice"]
        flat = [{**case, "notes": "; ".join(case["notes"])} for case in cases]
        super().__init__(
            {name: [case[name] for case in flat] for name in names},
            descriptions=_columns("stress"),
            shown=names[:8],
        )
        self.counts = {
            verdict: int((self["verdict"] == verdict).sum()) for verdict in ("pass", "flagged", "fail")
        }
        self.pictures = pictures

    def plot(self, case: int | None = None, *, axes: _Axes | None = None) -> _Axes:
        """Plot all verdicts, or the end state of a case, with matplotlib.

        Parameters
        ----------
        case : int, optional
            Row of the case whose end state is drawn, projected to x and y, in 2D coloured by ``det F``;
            default: all verdicts.
        axes : matplotlib.axes.Axes, optional
            Axes to draw into; default: new ones.

        Returns
        -------
        matplotlib.axes.Axes
            The axes.

        Examples
        --------
        >>> axes = stress(only=["D3"], quick=True, materials=["stable-neo-hookean"]).plot()
        """
        if case is not None:
            return self._picture(case, axes)

        def label(i: int) -> str:
            return f"{self['row'][i]} {self['name'][i]} {self['dimension'][i]}D"

        def setting(i: int) -> str:
            return (
                f"{self['material'][i]} {self['poisson'][i]:g}\n{self['integrator'][i]}, {self['solver'][i]}"
            )

        labels = list(dict.fromkeys(map(label, range(self.rows))))
        settings = list(dict.fromkeys(map(setting, range(self.rows))))
        worst = ["pass", "flagged", "fail"]
        grid = np.full((len(labels), len(settings)), -1)
        for i, verdict in enumerate(self["verdict"].tolist()):
            at = labels.index(label(i)), settings.index(setting(i))
            grid[at] = max(grid[at], worst.index(verdict))
        axes = axes_or_new(axes)
        _cells(axes, grid, worst)
        axes.set_yticks(range(len(labels)), labels)
        axes.set_xticks(range(len(settings)), settings, rotation=90)
        return axes

    def _picture(self, case: int, axes: _Axes | None) -> _Axes:
        picture = self.pictures[case]
        if picture is None:
            raise ValueError(f"case {case} has no picture of its end state")
        axes = axes_or_new(axes)
        x, y = picture["positions"][:, 0], picture["positions"][:, 1]
        if picture["J"].size:
            drawn = axes.tripcolor(
                x, y, picture["triangles"], facecolors=picture["J"], edgecolors="0.3", linewidth=0.3
            )
            axes.figure.colorbar(drawn, label="det F")
        else:
            axes.triplot(x, y, picture["triangles"], color="0.3", linewidth=0.5)
        axes.set(
            aspect="equal", xlabel="x [m]", ylabel="y [m]", title=f"{self['row'][case]} {self['name'][case]}"
        )
        return axes


def stress(
    scene: Scene | None = None,
    *,
    only: Sequence[str] = (),
    materials: Sequence[str] = (),
    integrators: Sequence[str] = (),
    solvers: Sequence[str] = (),
    quick: bool = False,
    progress: bool = False,
    callback: Watcher | None = None,
) -> Stress:
    """Run robustness tests on the solvers or on a scene, as ``pliant stress``.

    Parameters
    ----------
    scene : Scene, optional
        Scene to perturb, instead of the built-in suite.
    only : sequence of str, optional
        Rows of the suite, or names of cases: ``"torture"``, ``"D1"`` to ``"D13"``, ``"K18"``; default: all
        of these. ``"K18-long"``, contact over hundreds and thousands of steps, takes hours, and runs only if
        it or one of its cases is named.
    materials : sequence of str, optional
        Materials of the suite.
    integrators : sequence of str, optional
        Integrators.
    solvers : sequence of str, optional
        Linear solvers: ``"auto"``, ``"cholesky"``, ``"cg"``, ``"multigrid"``, ``"matrix-free"``.
    quick : bool, default False
        True for the cases that take a tenth of a second or less.
    progress : bool, default False
        True to show each case on standard error.
    callback : callable, optional
        Called with each finished case, a dictionary of the columns. An exception ends the suite.

    Returns
    -------
    Stress
        Table with plots. A failed case is a row of it, not an exception.

    Raises
    ------
    SceneError
        The scene cannot be simulated; there is no such integrator.
    ValueError
        No case matches.
    KeyboardInterrupt
        Ctrl-C, between two cases.

    Examples
    --------
    >>> found = stress(only=["D3"], quick=True, materials=["stable-neo-hookean"])
    >>> found.counts["fail"]
    0
    """
    given = {"only": only, "materials": materials, "integrators": integrators, "solvers": solvers}
    for name, value in given.items():
        if isinstance(value, str):
            raise TypeError(f"{name} is a list of names, got {value!r}")
    options = {**{name: list(value) for name, value in given.items()}, "quick": quick}
    watch = _watching(
        progress,
        callback,
        lambda case: f"{case['row']} {case['name']}, {case['integrator']}: {case['verdict']}",
    )
    return Stress(*_stress(scene, options, watch))


@dataclass(frozen=True)
class StabilityMap:
    """Map of stable steps of an integrator, by step and by a parameter of the scene.

    Attributes
    ----------
    integrator : str
        Name of the integrator.
    against : str
        Parameter of the rows: ``"young"``, ``"poisson"``, ``"density"``, ``"gravity"``.
    steps : ndarray of float64, shape (s,)
        The steps [s].
    values : ndarray of float64, shape (v,)
        Parameter values of the rows: a factor of stiffness, density or gravity, or Poisson's ratio.
    predicted : ndarray of float64, shape (v,)
        Linear stability limit of each row at its initial state [s]; infinite if any step is stable, 0 if none
        is.
    status : ndarray of str, shape (v, s)
        Result of each step: ``"ok"``, ``"diverged"``, ``"unsolved"``.
    """

    integrator: str
    against: str
    steps: Array
    values: Array
    predicted: Array
    status: Array


class Stability(Table):
    """Largest stable steps of a scene, one row per integrator; returned by `stability`.

    Fields are those of ``pliant stability --json``.

    Attributes
    ----------
    map : StabilityMap
        Stable steps of the first integrator.
    amplification : Table
        Amplification of an oscillator in one step, by ``integrator`` and ``z``, the step times the angular
        frequency: the spectral radius ``measured``, and that from the ``formula`` of the integrator.

    Notes
    -----
    Columns:
    """

    def __init__(self, found: dict[str, Any]) -> None:
        rows = [{**limit, **drift} for limit, drift in zip(found["limits"], found["energy_drift"])]
        names = ["integrator", "predicted", "measured", "above", "doubles_at", "trials"]
        names += ["step", "status", "per_second", "amplitude"]
        columns = {name: [row[name] for row in rows] for name in names}
        columns["predicted"] = _limits(columns["predicted"])
        columns["above"] = [above or "" for above in columns["above"]]
        super().__init__(columns, descriptions=_columns("stability"))
        curves = found["amplification"]
        self.amplification = Table(
            {
                "integrator": [curve["integrator"] for curve in curves for _ in curve["z"]],
                **{
                    name: [value for curve in curves for value in curve[name]]
                    for name in ("z", "measured", "formula")
                },
            }
        )
        about = found["map"]
        about["predicted"] = _limits(about["predicted"])
        names = ["steps", "values", "predicted", "status"]
        self.map = StabilityMap(
            about["integrator"], about["against"], *(np.array(about[name]) for name in names)
        )

    def plot(self, what: Literal["map", "amplification"] = "map", *, axes: _Axes | None = None) -> _Axes:
        """Plot the stable steps of the first integrator, or the amplification of an oscillator by each.

        This requires matplotlib.

        Parameters
        ----------
        what : {"map", "amplification"}
            Plot to draw.
        axes : matplotlib.axes.Axes, optional
            Axes to draw into; default: new ones.

        Returns
        -------
        matplotlib.axes.Axes
            The axes.

        Examples
        --------
        >>> axes = stability(scene, integrators=["symplectic-euler"], quick=True).plot("amplification")
        >>> axes.get_xlabel()
        'h omega'
        """
        if what not in ("map", "amplification"):
            raise ValueError(f'what is "map" or "amplification", got {what!r}')
        axes = axes_or_new(axes)
        if what == "map":
            kinds, about = ["ok", "unsolved", "diverged"], self.map
            _cells(axes, np.vectorize(kinds.index)(about.status), kinds)
            axes.invert_yaxis()
            axes.set_xticks(range(len(about.steps)), [f"{step:.0e}" for step in about.steps], rotation=90)
            axes.set_yticks(range(len(about.values)), [f"{value:g}" for value in about.values])
            rows = {
                "young": "times the stiffness",
                "poisson": "Poisson's ratio",
                "density": "times the density of the first body",
                "gravity": "times the mutual gravity",
            }
            axes.set(
                xlabel="step [s]",
                ylabel=rows[about.against],
                title=f"{about.integrator}: stable steps",
            )
            return axes
        curves = self.amplification
        for scheme in dict.fromkeys(curves["integrator"].tolist()):
            here = curves["integrator"] == scheme
            axes.plot(curves["z"][here], curves["measured"][here], label=scheme)
        axes.axhline(1.0, color="0.7", linestyle=":")
        axes.set(xscale="log", ylim=(0.0, 2.0), xlabel="h omega", ylabel="spectral radius of one step")
        axes.legend()
        return axes


def stability(
    scene: Scene,
    *,
    integrators: Sequence[str] = (),
    against: Literal["young", "poisson", "density", "gravity"] | None = None,
    quick: bool = False,
    progress: bool = False,
    callback: Watcher | None = None,
) -> Stability:
    """Find the largest stable step of a scene, as ``pliant stability``.

    Limits are predicted, measured, and mapped as a function of a parameter.

    Parameters
    ----------
    scene : Scene
        The scene.
    integrators : sequence of str, optional
        Integrators; default: all dynamic ones, the scene's own first. The map belongs to the first.
    against : {"young", "poisson", "density", "gravity"}, optional
        Parameter of the map; default: the stiffness, or in scenes without one the mutual gravity, or the
        density.
    quick : bool, default False
        True for a coarse map.
    progress : bool, default False
        True to show each integrator on standard error.
    callback : callable, optional
        Called with ``{"limit": {...}, "drift": {...}}`` of each finished integrator. An exception ends the
        search.

    Returns
    -------
    Stability
        Table with plots.

    Raises
    ------
    SceneError
        The scene cannot be simulated; it does not have the parameter of the map.
    ValueError
        There is no such integrator; the scene is quasi-static.
    KeyboardInterrupt
        Ctrl-C, between two integrators.

    Examples
    --------
    >>> found = stability(scene, integrators=["symplectic-euler"], quick=True)
    >>> 0.5 < float(found["measured"][0] / found["predicted"][0]) < 1.5
    True
    """
    if isinstance(integrators, str):
        raise TypeError(f"integrators is a list of names, got {integrators!r}")
    watch = _watching(
        progress,
        callback,
        lambda found: f"{found['limit']['integrator']}: up to {found['limit']['measured']:.4g} s",
    )
    return Stability(_stability(scene, list(integrators), against, quick, watch))


def _limits(values: list[float | None]) -> list[float]:
    return [float("inf") if value is None else value for value in values]


def _cells(axes: _Axes, grid: Array, kinds: list[str]) -> None:
    """Draw cells in the colours of their kinds; -1 is empty."""
    from matplotlib.colors import ListedColormap
    from matplotlib.patches import Patch

    colours = [_COLOURS[kind] for kind in kinds]
    masked = np.ma.masked_less(grid, 0)
    axes.imshow(masked, cmap=ListedColormap(colours), vmin=-0.5, vmax=len(kinds) - 0.5, aspect="auto")
    axes.legend(handles=[Patch(color=colour, label=kind) for kind, colour in zip(kinds, colours)])


def _document(table: type[Table], report: str) -> None:
    """Add the descriptions of the columns from the library."""
    columns = "".join(f"\n    - ``{name}``: {text}" for name, text in _columns(report).items())
    table.__doc__ = f"{(table.__doc__ or '').rstrip()}\n{columns}\n    "


_document(Study, "study")
_document(Stress, "stress")
_document(Stability, "stability")
