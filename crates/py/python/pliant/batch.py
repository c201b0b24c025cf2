"""Many simulations: at once on the threads of this machine, or by any executor."""

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
    """Take steps of many simulations at once, on threads that do not hold the lock of the interpreter.

    Parameters
    ----------
    simulations : iterable of Scene, Simulation or State
        Scenes start at their beginning, simulations go on from where they are, and are what is returned: none
        may occur twice. States are those of `scene`, each the start of a simulation of its own.
    steps : int
        How many each takes.
    threads : int, optional
        How many threads; as many as processors without it. Results are the same bits for any number.
    scene : Scene or Simulation, optional
        What states are states of; of a simulation they take its parameters, forces and pins along.

    Returns
    -------
    list of Simulation
        In the order given, each after its steps.

    Raises
    ------
    StepError
        Of the first simulation that could not take a step; its message says which one. All others have taken
        theirs.
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
    """What became of one simulation of a sweep.

    Attributes
    ----------
    parameters : dict of str to object
        Values by their paths.
    time : float
        Simulated time reached [s].
    steps : int
        Steps taken.
    energy : dict of str to float
        Energies at the end [J].
    positions, velocities : ndarray of float64, shape (n, dim)
        At the end [m], [m/s].
    error : SceneError or StepError or None
        Why it ended early, or did not begin.
    result : object
        What the function `measure` of the sweep returned.
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
    """Every combination of the values, the last varied fastest.

    Parameters
    ----------
    values : mapping of str to sequence
        Values by their paths.

    Returns
    -------
    list of dict of str to object
        One for each combination: values by their paths.

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
    """Run a scene with every combination of some of its values.

    Parameters
    ----------
    scene : Scene
        What is varied.
    values : mapping of str to sequence, or iterable of mappings
        Values by their paths, ``{"body.0.elastic.corotated.young": [1e5, 1e6]}``: all combinations; or the
        combinations themselves.
    executor : concurrent.futures.Executor, optional
        Who does the work: a thread pool of as many threads as processors without it. A process pool; that of
        a cluster of Dask, ``client.get_executor()``: a simulation whose worker dies is run again by another.
    measure : callable, optional
        Called with the `Simulation` at the end of each run; what it returns is `Outcome.result`. Executors of
        other processes pickle it.
    record : str or os.PathLike, optional
        A directory, made if need be, for files ``0000.mcap``, ``0001.mcap``, ..., seen by all workers.
    overwrite : bool, default False
        Whether files may be there already.

    Returns
    -------
    list of Outcome
        In the order of the combinations. Runs that fail do not end the sweep: see `Outcome.error`.

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
