"""Many simulations, on the threads of this machine or on any executor."""

from __future__ import annotations

import itertools
import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from ._errors import SceneError, StepError
from ._pliant import Scene, Simulation, State, _rollout

Array = npt.NDArray[np.float64]


def rollout(
    simulations: Iterable[Scene | Simulation | State],
    steps: int,
    *,
    threads: int | None = None,
    scene: Scene | Simulation | None = None,
) -> list[Simulation]:
    """Run steps of many simulations in parallel, on threads that release the GIL.

    Parameters
    ----------
    simulations : iterable of Scene, Simulation or State
        Scenes start at their initial state. Simulations continue from their current state, and are returned;
        each may occur once. States belong to `scene`, and each starts a new simulation.
    steps : int
        Number of steps of each.
    threads : int, optional
        Number of threads; default: all processors. Results do not depend on it.
    scene : Scene or Simulation, optional
        Scene of the states; a simulation also provides its parameters, forces and pins.

    Returns
    -------
    list of Simulation
        The simulations after their steps, in the given order.

    Raises
    ------
    StepError
        A step failed: the error of the first such simulation, named in the message. All others have completed
        their steps.
    ValueError
        A simulation occurs twice; a state is of another scene.

    Examples
    --------
    >>> first, second = rollout([scene, scene.with_changes({"world.gravity": [0.0, -1.6]})], 10)
    >>> first.steps, second.steps
    (10, 10)
    """
    steppers = [_stepper(one, scene) for one in simulations]
    if len({id(one) for one in steppers}) < len(steppers):
        raise ValueError("a simulation occurs twice: use its clone()")
    if threads is not None and threads < 1:
        raise ValueError(f"threads must be 1 or more, got {threads}")
    for number, error in enumerate(_rollout(steppers, steps, threads or 0)):
        if isinstance(error, StepError):
            error.args = (f"simulation {number}: {error.message}",)
            error.message = error.args[0]
        if error is not None:
            raise error
    return steppers


def _stepper(one: Scene | Simulation | State, scene: Scene | Simulation | None) -> Simulation:
    if isinstance(one, Simulation):
        return one
    if isinstance(one, Scene):
        return Simulation(one)
    if scene is None:
        raise TypeError("a state does not know its scene: name it by `scene=`")
    simulation = Simulation(scene) if isinstance(scene, Scene) else scene.clone()
    simulation.state = one
    return simulation


@dataclass(frozen=True)
class Outcome:
    """Result of one simulation of a sweep.

    Attributes
    ----------
    parameters : dict of str to object
        Values by path.
    time : float
        Simulated time reached [s].
    steps : int
        Steps taken.
    energy : dict of str to float
        Energies at the end [J].
    positions, velocities : ndarray of float64, shape (n, dim)
        Final positions [m] and velocities [m/s].
    error : SceneError or StepError or None
        Error that ended or prevented the run.
    result : object
        Return value of the function `measure` of the sweep.
    """

    parameters: dict[str, Any]
    time: float
    steps: int
    energy: dict[str, float]
    positions: Array
    velocities: Array
    error: SceneError | StepError | None
    result: Any = None


def _simulate(
    scene: Scene,
    parameters: dict[str, Any],
    record: str | None,
    overwrite: bool,
    measure: Callable[[Simulation], Any] | None,
) -> Outcome:
    """One run: a function of what it is given, so that it can be done again elsewhere if a worker dies."""
    nothing = np.empty((0, scene.dimension))
    try:
        simulation = Simulation(scene.with_changes(parameters))
    except SceneError as error:
        return Outcome(parameters, 0.0, 0, {}, nothing, nothing, error)
    failure: StepError | None = None
    try:
        simulation.run(record=record, overwrite=overwrite)
    except StepError as error:
        failure = error
    result = measure(simulation) if measure is not None and failure is None else None
    return Outcome(
        parameters,
        simulation.time,
        simulation.steps,
        simulation.energy(),
        simulation.positions,
        simulation.velocities,
        failure,
        result,
    )


def combinations(values: Mapping[str, Sequence[Any]]) -> list[dict[str, Any]]:
    """Return all combinations of the values; the last one varies fastest.

    Parameters
    ----------
    values : mapping of str to sequence
        Values by path.

    Returns
    -------
    list of dict of str to object
        One dict per combination: values by path.

    Examples
    --------
    >>> combinations({"time.step": [1e-3, 5e-4], "body.0.order": [1]})
    [{'time.step': 0.001, 'body.0.order': 1}, {'time.step': 0.0005, 'body.0.order': 1}]
    """
    return [dict(zip(values, chosen)) for chosen in itertools.product(*values.values())]


def sweep(
    scene: Scene,
    values: Mapping[str, Sequence[Any]] | Iterable[Mapping[str, Any]],
    *,
    executor: Executor | None = None,
    measure: Callable[[Simulation], Any] | None = None,
    record: str | os.PathLike[str] | None = None,
    overwrite: bool = False,
) -> list[Outcome]:
    """Run a scene with all combinations of some of its values.

    Parameters
    ----------
    scene : Scene
        The scene to vary.
    values : mapping of str to sequence, or iterable of mappings
        Values by path, ``{"body.0.elastic.corotated.young": [1e5, 1e6]}``: all combinations run; or an
        iterable of combinations.
    executor : concurrent.futures.Executor, optional
        Executor of the runs; default: a thread pool of all processors. Process pools and Dask clusters,
        ``client.get_executor()``, work too: Dask restarts a simulation whose worker dies.
    measure : callable, optional
        Called with the `Simulation` at the end of each run; its return value is `Outcome.result`. Executors
        of other processes pickle it.
    record : str or os.PathLike, optional
        Directory for ``0000.mcap``, ``0001.mcap``, ..., created if needed, visible to all workers.
    overwrite : bool, default False
        True to replace existing files.

    Returns
    -------
    list of Outcome
        Results in the order of the combinations. A failed run does not end the sweep: see `Outcome.error`.

    Raises
    ------
    SceneError
        The scene has no such path.

    Examples
    --------
    >>> outcomes = sweep(scene, {"body.0.elastic.corotated.poisson": [0.1, 0.3]})
    >>> [outcome.steps for outcome in outcomes]
    [100, 100]
    """
    tasks = combinations(values) if isinstance(values, Mapping) else [dict(one) for one in values]
    if record is not None:
        os.makedirs(record, exist_ok=True)
    path = [os.path.join(record, f"{i:04}.mcap") if record is not None else None for i in range(len(tasks))]
    own = ThreadPoolExecutor(os.cpu_count()) if executor is None else None
    workers = executor or own
    assert workers is not None
    futures: list[Future[Outcome]] = []
    try:
        for parameters, file in zip(tasks, path):
            futures.append(workers.submit(_simulate, scene, parameters, file, overwrite, measure))
        return [future.result() for future in futures]
    finally:
        for future in futures:
            future.cancel()
        if own is not None:
            own.shutdown()
