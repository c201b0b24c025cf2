"""What the commands ``study``, ``stress`` and ``stability`` report, as tables."""

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

#: How the ways of failing are drawn.
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
    """Who is shown each thing that is found: a line on standard error, the function of the user, nobody."""
    if not progress:
        return callback

    def show(found: dict[str, Any]) -> None:
        print(line(found), file=sys.stderr)
        if callback is not None:
            callback(found)

    return show


class Study(Table):
    """Error against run time, one row for each run: what `study` returns.

    Columns are those of ``rows.csv`` of ``pliant study``.

    Attributes
    ----------
    name : str
        Of the scene.
    title : str
        Of the scene.
    lines : Table
        One row for each scheme: ``variant``, ``integrator``, ``order_nominal``, ``order_observed``, ``stop``:
        why it was not refined further.
    front : Table
        The runs that no other beats in error and time together: ``variant``, ``integrator``, ``dt``,
        ``error``, ``wall_min_s``.
    references : list of dict
        What each variant is compared with: ``variant``, ``id``, ``how``, ``error``, ``disagreement``: how far
        a second scheme is from it, None where there is none.
    recommendations : dict of str to str
        What to write into the scene for the error that is allowed, as TOML, by what was varied of the scene
        itself: ``path=value``, empty for the scene as it is. Variants that have one reference are compared:
        what only solves the same in another way.
    recommendation : str
        All of them, one below the other.
    provenance : dict of str to str
        What it ran on.

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
        """List the errors of a run at each time of comparison, as far as it came.

        Parameters
        ----------
        row : int
            Which.

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
        """Change of the energy of a run over the energy in play.

        Parameters
        ----------
        row : int
            Which.

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
        """Draw error against run time or step, a line for each scheme; by matplotlib, if installed.

        Parameters
        ----------
        against : {"time", "step"}
            What is to the right: the shortest of the timed runs, or the step.
        variant : str, optional
            One of the column of this name; the first without it.
        axes : matplotlib.axes.Axes, optional
            Where to; new ones without it.

        Returns
        -------
        matplotlib.axes.Axes
            Runs that failed are crosses at the top.

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
        axes.axhline(10.0 * reference["error"], color="0.7", linestyle=":", label="as the reference can tell")
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
    """Compare schemes and steps on a scene, as ``pliant study``.

    Error stands against run time, beside a reference of known quality.

    Each error is an error in time, on this mesh. What is not given here is what the scene says under
    ``[study]``, or the usual.

    Parameters
    ----------
    scene : Scene
        What is simulated.
    integrators : sequence of str or mapping, optional
        The schemes, as a scene names them, beside the scene's own; a dozen without it.
    steps : sequence of float or str, optional
        Steps [s]; chosen by factors of 2 until errors no longer fall, without it.
    tolerances : sequence of float, optional
        Tolerances of schemes whose steps follow the error; chosen by factors of 10 where no steps are given
        either.
    vary : mapping of str to sequence, optional
        What is varied beside, ``{"body.0.elastic.neo-hookean.young": [1e5, 1e6]}``: every combination.
    times : int, optional
        At how many times states are compared, at least 20.
    error : float, optional
        The largest error that the recommendation may have, relative; 0.01 without it.
    reference : {"auto", "exact", "computed"}
        Where the reference comes from.
    repeats : int, optional
        Timed runs of each row; 7, or as many as take a second, without it.
    threads : int, default 1
        Threads that steps run on.
    budget : float, optional
        Wall time of all of it [s]; 60 where steps are chosen, without it.
    folder : str or os.PathLike, optional
        Where references and finished rows are kept: the same call, or ``pliant study -o``, goes on from
        there.
    report : str or os.PathLike, optional
        A page of HTML to write, with charts.
    progress : bool, default False
        Whether to show each row on standard error.
    callback : callable, optional
        Called with each finished row, a dictionary of the columns. What it raises ends the study.

    Returns
    -------
    Study
        A table that plots. Runs that fail are rows of it.

    Raises
    ------
    SceneError
        The scene, or a variant of it, cannot be simulated; it has no such scheme.
    ValueError
        Nothing moves, or the scene is quasi-static; an exact reference is asked for where none is known.
    RuntimeError
        No reference was found in the time given.
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
    """What stands what breaks simulators, one row for each case: what `stress` returns.

    Columns are those of ``stress.csv`` of ``pliant stress``.

    Attributes
    ----------
    counts : dict of str to int
        How many cases are ``pass``, ``flagged`` and ``fail``.
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
        """Draw all verdicts, or the end state of a case, by matplotlib, which must be installed.

        Parameters
        ----------
        case : int, optional
            The row whose end state is drawn, projected to x and y, in 2D with ``det F`` in colours; all
            verdicts without it.
        axes : matplotlib.axes.Axes, optional
            Where to; new ones without it.

        Returns
        -------
        matplotlib.axes.Axes
            What was drawn into.

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
    """Put the solvers, or a scene, through what breaks simulators, as ``pliant stress``.

    Parameters
    ----------
    scene : Scene, optional
        What is put out of shape in place of the suite's own scenes.
    only : sequence of str, optional
        Rows of the suite, and names of cases: ``"torture"``, ``"D1"`` to ``"D13"``, ``"K18"``; all these
        without it. ``"K18-long"``, contact through hundreds and thousands of steps, takes hours, and runs
        only if it or one of its cases is named.
    materials : sequence of str, optional
        Materials of the suite.
    integrators : sequence of str, optional
        Schemes.
    solvers : sequence of str, optional
        Linear solvers: ``"auto"``, ``"cholesky"``, ``"cg"``, ``"multigrid"``, ``"matrix-free"``.
    quick : bool, default False
        What takes a tenth of a second or less.
    progress : bool, default False
        Whether to show each case on standard error.
    callback : callable, optional
        Called with each case that is done, a dictionary of the columns. What it raises ends the suite.

    Returns
    -------
    Stress
        A table that plots. A case that fails is a row of it, no exception.

    Raises
    ------
    SceneError
        The scene cannot be simulated; there is no such scheme.
    ValueError
        No case is of these.
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
    """Which steps a scheme can take, against what the scene is made of.

    Attributes
    ----------
    integrator : str
        The scheme.
    against : str
        What rows differ in: ``"young"``, ``"poisson"``, ``"density"``, ``"gravity"``.
    steps : ndarray of float64, shape (s,)
        The steps [s].
    values : ndarray of float64, shape (v,)
        Of the rows: the factor of the stiffness, the density or gravity, or Poisson's ratio.
    predicted : ndarray of float64, shape (v,)
        The limit of each row, linearised at its start [s]; infinite where any step is stable, 0 where none
        is.
    status : ndarray of str, shape (v, s)
        What came of each step: ``"ok"``, ``"diverged"``, ``"unsolved"``.
    """

    integrator: str
    against: str
    steps: Array
    values: Array
    predicted: Array
    status: Array


class Stability(Table):
    """Largest steps that a scene can take, one row for each scheme: what `stability` returns.

    Fields are those of ``pliant stability --json``.

    Attributes
    ----------
    map : StabilityMap
        Which steps the first scheme can take.
    amplification : Table
        What one step does to an oscillator, by ``integrator`` and ``z``, the step times the angular
        frequency: the spectral radius ``measured``, and that by the ``formula`` of the scheme.

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
        """Draw which steps the first scheme can take, or what a step of each does to an oscillator.

        It is drawn by matplotlib, which must be installed.

        Parameters
        ----------
        what : {"map", "amplification"}
            Which.
        axes : matplotlib.axes.Axes, optional
            Where to; new ones without it.

        Returns
        -------
        matplotlib.axes.Axes
            What was drawn into.

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
                title=f"{about.integrator}: which steps it takes",
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
    """Find how large a step a scene can take, as ``pliant stability``.

    Limits are predicted, measured, and set against what the scene is made of.

    Parameters
    ----------
    scene : Scene
        What is simulated.
    integrators : sequence of str, optional
        The schemes; all that move things, the scene's own first, without it. The map is of the first.
    against : {"young", "poisson", "density", "gravity"}, optional
        What the map has beside the step; without it the stiffness, of scenes without one their mutual
        gravity, or their masses.
    quick : bool, default False
        A coarse map.
    progress : bool, default False
        Whether to show each scheme on standard error.
    callback : callable, optional
        Called with ``{"limit": {...}, "drift": {...}}`` of each scheme that is done. What it raises ends the
        search.

    Returns
    -------
    Stability
        A table that plots.

    Raises
    ------
    SceneError
        The scene cannot be simulated; nothing in it can be varied so.
    ValueError
        There is no such scheme; the scene is quasi-static.
    KeyboardInterrupt
        Ctrl-C, between two schemes.

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
    """Cells in the colours of their kinds; -1 is none."""
    from matplotlib.colors import ListedColormap
    from matplotlib.patches import Patch

    colours = [_COLOURS[kind] for kind in kinds]
    masked = np.ma.masked_less(grid, 0)
    axes.imshow(masked, cmap=ListedColormap(colours), vmin=-0.5, vmax=len(kinds) - 0.5, aspect="auto")
    axes.legend(handles=[Patch(color=colour, label=kind) for kind, colour in zip(kinds, colours)])


def _document(table: type[Table], report: str) -> None:
    """Adds what the library says of the columns."""
    columns = "".join(f"\n    - ``{name}``: {text}" for name, text in _columns(report).items())
    table.__doc__ = f"{(table.__doc__ or '').rstrip()}\n{columns}\n    "


_document(Study, "study")
_document(Stress, "stress")
_document(Stability, "stability")
