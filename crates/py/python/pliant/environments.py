"""Many copies of one scene that step together: an environment for learning, of Gymnasium if installed."""

from __future__ import annotations

import os
import warnings
from collections.abc import Callable, Sequence
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from . import spaces
from ._errors import StepError
from ._pliant import Batch, Scene, Simulation
from .actions import Action, ForceAction, FunctionAction, Move, PinAction, ValueAction

Array = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]
Quantity = Callable[["VectorEnvironment"], npt.ArrayLike]
Start = Callable[[np.random.Generator, Array, Array], tuple[npt.ArrayLike, npt.ArrayLike]]

#: What may be observed by name.
OBSERVED = ("positions", "velocities", "displacements", "probes", "reactions", "contacts", "time", "actions")


class VectorEnvironment:
    """Copies of a simulation that step together, as `vector` makes them.

    Where Gymnasium is installed it is a ``gymnasium.vector.VectorEnv``, and its spaces are those of
    Gymnasium. All arrays have the environments along their first axis, n in what follows.

    Attributes
    ----------
    num_envs : int
        How many environments, n.
    single_action_space, action_space : Box
        Actions of one, shape (k,), and of all, shape (n, k).
    single_observation_space, observation_space : Box
        Observations of one, shape (m,), and of all, shape (n, m).
    positions, velocities : ndarray of float64, shape (n, vertices, dim)
        Of all environments now [m], [m/s], read only: one contiguous array each, the same each time.
    previous_positions : ndarray of float64, shape (n, vertices, dim)
        Positions before the last step of the environment [m].
    rest_positions : ndarray of float64, shape (vertices, dim)
        Rest positions [m].
    actions : ndarray of float64, shape (n, k)
        The last ones, within their bounds; zero after a reset.
    elapsed : ndarray of int64, shape (n,)
        Steps of the environment since the last reset.
    step_duration : float
        Simulated time of a step of the environment [s].
    scene : Scene
        What is simulated.

    Notes
    -----
    Copies step on threads that do not hold the lock of the interpreter, each on one of them at a time:
    positions have the bits of a simulation on its own, whatever the number of threads.

    Examples
    --------
    >>> scene = Scene.from_toml("scenes/cantilever_fem_2d.toml")
    >>> env = vector(scene, 4, action=ForceAction([79], axes="y"), substeps=10)
    >>> observations, info = env.reset(seed=1)
    >>> observations, rewards, terminated, truncated, info = env.step(np.zeros((4, 1)))
    >>> env.positions.shape, observations.shape, terminated.any()
    ((4, 80, 2), (4, 320), np.False_)
    """

    metadata: dict[str, Any] = {}
    spec: Any = None
    render_mode: str | None = None
    closed = False

    def __init__(
        self,
        simulation: Simulation,
        num_envs: int,
        action: Sequence[Action],
        observe: Sequence[str | Quantity],
        reward: Quantity | None,
        terminated: Quantity | None,
        start: Start | None,
        substeps: int,
        max_steps: int | None,
        autoreset: str,
        on_failure: str,
        threads: int,
        dtype: npt.DTypeLike,
    ) -> None:
        self.num_envs, self.scene = num_envs, simulation.scene
        self.dimension, self.vertex_count = simulation.dimension, simulation.vertex_count
        self.rest_positions = simulation.rest_positions
        self.step_duration = substeps * simulation.step_size
        self._pins = simulation.pins
        self._batch = Batch(simulation, num_envs, threads)
        self.positions: Array = self._batch.positions
        self.velocities: Array = self._batch.velocities
        self.previous_positions: Array = self.positions.copy()
        self.elapsed = np.zeros(num_envs, np.int64)
        self._start_positions, self._start_velocities = self.positions[0].copy(), self.velocities[0].copy()
        self._reward, self._terminated, self._start = reward, terminated, start
        self._substeps, self._max_steps, self._mode, self._on_failure = (
            substeps,
            max_steps,
            autoreset,
            on_failure,
        )
        self._generators = [np.random.default_rng() for _ in range(num_envs)]
        self._ended: Mask = np.zeros(num_envs, bool)
        self._forces: Array | None = None
        self._bind(list(action))
        self._observe = [self._observed(item) for item in observe]
        self._spaces(np.dtype(dtype))

    # What is made once.

    def _bind(self, actions: list[Action]) -> None:
        self._drivers: list[tuple[Action, slice]] = []
        lows, highs, at = [], [], 0
        for action in actions:
            low, high = action._bind(self)
            self._drivers.append((action, slice(at, at + len(low))))
            at += len(low)
            lows.append(low)
            highs.append(high)
        self._low, self._high = (
            np.concatenate(bounds) if bounds else np.empty(0) for bounds in (lows, highs)
        )
        self.actions = np.zeros((self.num_envs, at))
        functions = [action for action, _ in self._drivers if isinstance(action, FunctionAction)]
        self._every = min([action.every or self._substeps for action in functions], default=self._substeps)
        self._has_forces = any(isinstance(action, (ForceAction, FunctionAction)) for action in actions)

    def _observed(self, item: str | Quantity) -> Quantity:
        if callable(item):
            return item
        kind, _, name = item.partition(":")
        if kind not in OBSERVED or (name and kind not in ("probes", "reactions", "contacts")):
            raise ValueError(
                f"there is no {item!r} to observe; there are {', '.join(OBSERVED)}, one of the probes, "
                f"reactions or contacts "
                "by `reactions:NAME`, and functions of the environment"
            )
        match kind:
            case "displacements":
                return lambda env: env.positions - env.rest_positions
            case "probes":
                self.probes(name or None)
                return lambda env: env.probes(name or None)
            case "reactions":
                self.reactions(name or None)
                return lambda env: env._in_space(env.reactions(name or None))
            case "contacts":
                self.contact_forces(name or None)
                return lambda env: env.contact_forces(name or None)[..., : env.dimension]
            case "time":
                return lambda env: env.times
            case _:
                return lambda env: np.asarray(getattr(env, kind))

    def _in_space(self, reactions: Array) -> Array:
        """Components that there are: in the plane two of the force, one of the moment."""
        if self.dimension == 3:
            return reactions
        return np.concatenate([reactions[..., 0, :2], reactions[..., 1, 2:]], axis=-1)

    def _spaces(self, dtype: Any) -> None:
        n, m = self.num_envs, self._observation(np.dtype(float)).shape[1]
        self._dtype = dtype
        unbounded = np.full(m, np.inf)
        boxes, batched = spaces.boxes(
            [(self._low, self._high, np.float32), (-unbounded, unbounded, dtype)], n
        )
        self.single_action_space, self.single_observation_space = boxes
        self.action_space, self.observation_space = batched
        self.metadata = {
            "render_modes": [],
            "render_fps": 1.0 / self.step_duration,
            "autoreset_mode": spaces.autoreset_mode(self._mode),
        }

    # What is read.

    @property
    def times(self) -> Array:
        """ndarray of float64, shape (n,): Simulated times [s].

        Examples
        --------
        >>> env.times
        array([0., 0.])
        """
        return self._batch.times()

    def reactions(self, name: str | None = None) -> Array:
        """Measure the forces with which pins hold their vertices and walls push, now.

        Parameters
        ----------
        name : str, optional
            Of one, ``body/pin`` or ``wall0``; all in their order without it.

        Returns
        -------
        ndarray of float64, shape (n, names, 2, 3), or (n, 2, 3) of one
            Force [N] and moment [N m], as `Simulation.reactions` has them; zero where a pin has let go.

        Examples
        --------
        >>> env.reactions("beam/left").shape
        (2, 2, 3)
        """
        return _one(*self._batch.reactions(), name, "pin or wall")

    def probes(self, name: str | None = None) -> Array:
        """Measure positions and velocities of the probes of the scene, now.

        Parameters
        ----------
        name : str, optional
            Of one; all in their order without it.

        Returns
        -------
        ndarray of float64, shape (n, names, 2, dim), or (n, 2, dim) of one
            Position [m] and velocity [m/s].

        Examples
        --------
        >>> env.probes("tip")[0, 0]
        array([0.4, 0.1])
        """
        return _one(*self._batch.probes(), name, "probe")

    def contact_forces(self, body: str | None = None) -> Array:
        """Sum the normal forces and the friction of contact on bodies, now.

        Parameters
        ----------
        body : str, optional
            On one; on all in their order without it.

        Returns
        -------
        ndarray of float64, shape (n, bodies, 3), or (n, 3) of one
            [N]; zero without ``[contact]``.

        Examples
        --------
        >>> env.contact_forces("beam")
        array([[0., 0., 0.],
               [0., 0., 0.]])
        """
        return _one(*self._batch.contact_forces(), body, "body")

    def simulation(self, number: int) -> Simulation:
        """Make a simulation that goes on from where an environment is: to look at, to record, to measure.

        Parameters
        ----------
        number : int
            Which environment.

        Returns
        -------
        Simulation
            In the same state, with the same values, pins and forces. Solvers of implicit schemes forget what
            they have learnt from earlier steps, here as there.

        Examples
        --------
        >>> env.simulation(1).energy()["kinetic"]
        0.0
        """
        simulation = self._batch.copied(number)
        if self._forces is not None:
            simulation.external_forces = self._forces[number]
        return simulation

    def _observation(self, dtype: Any = None) -> npt.NDArray[Any]:
        parts = []
        for observe in self._observe:
            part = np.asarray(observe(self))
            if part.shape[:1] != (self.num_envs,):
                raise ValueError(f"what is observed has shape ({self.num_envs}, ..), got {part.shape}")
            parts.append(part.reshape(self.num_envs, -1))
        return np.concatenate(parts, axis=1).astype(dtype or self._dtype)

    def _each(self, quantity: Quantity, kind: Any, what: str) -> npt.NDArray[Any]:
        value = np.asarray(quantity(self), kind)
        if value.shape != (self.num_envs,):
            raise ValueError(f"{what} must have shape ({self.num_envs},), got {value.shape}")
        return value

    # What is done.

    def reset(
        self, *, seed: int | Sequence[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[npt.NDArray[Any], dict[str, Any]]:
        """Put environments back to their start.

        Parameters
        ----------
        seed : int or list of int, optional
            Seed of the numbers that `start` gets: environment i has ``seed + i``, or entry i. They go on
            without it.
        options : dict, optional
            ``"reset_mask"``: an array of bool, shape (n,), of the environments to put back; all without it.

        Returns
        -------
        observations : ndarray, shape (n, m)
            Of all environments.
        info : dict
            ``"time"``, shape (n,).

        Examples
        --------
        >>> observations, info = env.reset(seed=3, options={"reset_mask": np.array([True, False])})
        >>> info["time"]
        array([0., 0.])
        """
        mask = self._reset_mask(options)
        seeds = (
            [None if seed is None else seed + i for i in range(self.num_envs)]
            if not isinstance(seed, Sequence)
            else seed
        )
        if len(seeds) != self.num_envs:
            raise ValueError(f"there are {self.num_envs} environments, and {len(seeds)} seeds")
        for i in np.flatnonzero(mask):
            if seeds[int(i)] is not None:
                self._generators[i] = np.random.default_rng(seeds[int(i)])
        self._restart(mask)
        return self._observation(), self._info(mask)

    def _reset_mask(self, options: dict[str, Any] | None) -> Mask:
        if options is None or "reset_mask" not in options:
            return np.ones(self.num_envs, bool)
        mask = options["reset_mask"]
        if not isinstance(mask, np.ndarray) or mask.dtype != bool:
            raise TypeError(
                f"`options['reset_mask']` must be an array of bool, got {type(mask).__name__} {mask!r}"
            )
        if mask.shape != (self.num_envs,) or not mask.any():
            raise ValueError(
                f"`options['reset_mask']` must have shape ({self.num_envs},) and a True in it, got {mask}"
            )
        return mask

    def _restart(self, mask: Mask) -> None:
        for action, _ in self._drivers:
            if isinstance(action, ValueAction):
                action._reset(self, mask)
        x = v = None
        if self._start is not None:
            x, v = self.positions.copy(), self.velocities.copy()
            for i in np.flatnonzero(mask):
                x[i], v[i] = self._start(
                    self._generators[i], self._start_positions.copy(), self._start_velocities.copy()
                )
        self._batch.reset(mask, x, v)
        self.previous_positions[mask] = self.positions[mask]
        self.actions[mask] = 0.0
        if self._forces is not None:
            self._forces[mask] = 0.0
        self.elapsed[mask] = 0
        self._ended = self._ended & ~mask

    def step(self, actions: npt.ArrayLike) -> tuple[npt.NDArray[Any], Array, Mask, Mask, dict[str, Any]]:
        """Take a step of every environment: `substeps` steps of its simulation.

        Parameters
        ----------
        actions : array_like, shape (n, k)
            Numbers beyond their bounds are taken at them.

        Returns
        -------
        observations : ndarray, shape (n, m)
            After the step.
        rewards : ndarray of float64, shape (n,)
            What `reward` says of it.
        terminated : ndarray of bool, shape (n,)
            Where an episode ended by what happened, a step that could not be taken included.
        truncated : ndarray of bool, shape (n,)
            Where it ended by the number of its steps.
        info : dict
            ``"time"``, shape (n,). Where a simulation could not take a step ``"failure"``, the text,
            ``"failure_step"`` and ``"failure_time"``, each of shape (n,), and a mask ``"_failure"``. Where an
            environment was reset in this step (``"same-step"``) ``"final_obs"`` and ``"final_info"``.

        Raises
        ------
        ValueError
            An action has another shape or is not finite; an environment has ended and was not reset
            (``"disabled"``).

        Examples
        --------
        >>> observations, rewards, terminated, truncated, info = env.step(np.zeros((2, 1)))
        >>> rewards, truncated
        (array([0., 0.]), array([False, False]))
        """
        given = np.array(actions, float)
        if given.shape != self.actions.shape:
            raise ValueError(f"actions must have shape {self.actions.shape}, got {given.shape}")
        if not np.isfinite(given).all():
            first = int(np.flatnonzero(~np.isfinite(given).all(axis=1))[0])
            raise ValueError(f"actions must be finite, got {given[first]} of environment {first}")
        anew = self._ended.copy()
        if self._mode == "disabled" and anew.any():
            raise ValueError(
                f"environments {np.flatnonzero(anew).tolist()} have ended: reset them by `reset_mask`"
            )
        if anew.any():
            self._restart(anew)
        moving = ~anew
        self.actions[moving] = given.clip(self._low, self._high)[moving]
        np.copyto(self.previous_positions, self.positions)
        failures = self._advance(moving)
        self.elapsed[moving] += 1
        rewards = (
            np.zeros(self.num_envs) if self._reward is None else self._each(self._reward, float, "rewards")
        )
        terminated = np.zeros(self.num_envs, bool)
        if self._terminated is not None:
            terminated = self._each(self._terminated, bool, "`terminated`")
        # What an environment begins with is no step.
        rewards, terminated = np.where(anew, 0.0, rewards), terminated & moving
        terminated[list(failures)] = True
        truncated = moving & (self.elapsed >= (self._max_steps or np.inf))
        self._ended = terminated | truncated
        info = self._info(np.ones(self.num_envs, bool), failures)
        observations = self._observation()
        if self._mode == "same-step" and self._ended.any():
            observations, info = self._same_step(observations, info)
        return observations, rewards, terminated, truncated, info

    def _same_step(
        self, observations: npt.NDArray[Any], info: dict[str, Any]
    ) -> tuple[npt.NDArray[Any], dict[str, Any]]:
        ended = self._ended.copy()
        final = np.full(self.num_envs, None, object)
        for i in np.flatnonzero(ended):
            final[i] = observations[i]
        final_info = {key: value if key.startswith("_") else value.copy() for key, value in info.items()}
        final_info = {
            key: value & ended if key.startswith("_") else value for key, value in final_info.items()
        }
        self._restart(ended)
        info = self._info(np.ones(self.num_envs, bool))
        info.update(final_obs=final, _final_obs=ended, final_info=final_info, _final_info=ended.copy())
        return self._observation(), info

    def _advance(self, moving: Mask) -> dict[int, StepError]:
        failures: dict[int, StepError] = {}
        steered: list[Move] = []
        for action, numbers in self._drivers:
            if isinstance(action, ValueAction):
                action._set(self, self.actions[:, numbers], moving)
            elif isinstance(action, PinAction):
                steered.append(action._move(self, self.actions[:, numbers]))
        left, moving, moves = self._substeps, moving.copy(), steered or None
        while left > 0 and moving.any():
            count = min(left, self._every) if self._has_forces else left
            for number, error in self._batch.step(count, moving, self._acting(), moves):
                if not isinstance(error, StepError) or self._on_failure == "raise":
                    raise error
                failures[number] = error
                moving[number] = False
            left, moves = left - count, None
        for number, error in failures.items():
            warnings.warn(f"environment {number} has ended: {error.message}", RuntimeWarning, stacklevel=3)
        return failures

    def _acting(self) -> Array | None:
        if not self._has_forces:
            return None
        self._forces = np.zeros(self.positions.shape)
        for action, numbers in self._drivers:
            if isinstance(action, (ForceAction, FunctionAction)):
                action._add(self, self.actions[:, numbers], self._forces)
        return self._forces

    def _info(self, mask: Mask, failures: dict[int, StepError] | None = None) -> dict[str, Any]:
        info: dict[str, Any] = {"time": self.times, "_time": mask.copy()}
        if failures:
            failed = np.zeros(self.num_envs, bool)
            failed[list(failures)] = True
            texts = np.full(self.num_envs, None, object)
            steps, times = np.zeros(self.num_envs, np.int64), np.zeros(self.num_envs)
            for number, error in failures.items():
                texts[number], steps[number], times[number] = error.message, error.step, error.time
            for key, value in (("failure", texts), ("failure_step", steps), ("failure_time", times)):
                info[key], info[f"_{key}"] = value, failed.copy()
        return info

    def close(self, **_options: Any) -> None:
        """End; there is nothing to be freed.

        Parameters
        ----------
        **_options
            None is needed.

        Examples
        --------
        >>> env.close()
        >>> env.closed
        True
        """
        self.closed = True

    def __repr__(self) -> str:
        return f"<pliant.VectorEnvironment: {self.num_envs} of {self.scene!r}>"


def _one(names: list[str], values: Array, name: str | None, what: str) -> Array:
    if name is None:
        return values
    if name not in names:
        raise KeyError(f"there is no {what} {name!r}; there are {names}")
    return values[:, names.index(name)]


def vector(
    scene: Scene | Simulation,
    n: int,
    *,
    action: Action | Sequence[Action] = (),
    observe: str | Quantity | Sequence[str | Quantity] = ("positions", "velocities"),
    reward: Quantity | None = None,
    terminated: Quantity | None = None,
    start: Start | None = None,
    substeps: int = 1,
    max_steps: int | None = None,
    autoreset: Literal["next-step", "same-step", "disabled"] = "next-step",
    on_failure: Literal["terminate", "raise"] = "terminate",
    threads: int | None = None,
    dtype: npt.DTypeLike = np.float32,
) -> VectorEnvironment:
    """Make many environments of one scene that step together.

    Parameters
    ----------
    scene : Scene or Simulation
        What is simulated; from where a simulation is, with its pins, forces and materials.
    n : int
        How many.
    action : PinAction, ForceAction, FunctionAction, ValueAction, or a list of them
        What actions drive; the numbers of several follow each other.
    observe : str or callable, or a list of them
        Names: "positions", "velocities", "displacements" (from rest), "probes" and "reactions" (of pins and
        walls), "contacts" (the force of contact on each body), each of one by ``"reactions:NAME"``, "time",
        "actions". Functions of the `VectorEnvironment` return arrays of shape (n, ..).
    reward : callable, optional
        Function of the `VectorEnvironment` that returns rewards of shape (n,); zero without it.
    terminated : callable, optional
        Likewise, where an episode has ended: bool of shape (n,).
    start : callable, optional
        Called for each environment that is reset, with a `numpy.random.Generator` of its own, and positions
        [m] and velocities [m/s] of the start, shape (vertices, dim); returns those that it starts with.
    substeps : int, default 1
        Steps of the simulation in one of the environment.
    max_steps : int, optional
        Steps of the environment after which an episode is truncated.
    autoreset : {"next-step", "same-step", "disabled"}
        When an environment that has ended starts anew: in the next step, whose action is not looked at; in
        the same, whose observation is then that of the start; or by `reset` alone. The modes of Gymnasium.
    on_failure : {"terminate", "raise"}
        Whether an environment whose simulation cannot take a step has ended, with a warning and the reason in
        ``info``, while others go on; or the `StepError` is raised.
    threads : int, optional
        How many threads; as many as processors without it. Results are the same bits for any number.
    dtype : dtype, default float32
        Of observations.

    Returns
    -------
    VectorEnvironment
        Where Gymnasium is installed, a ``gymnasium.vector.VectorEnv`` too.

    Raises
    ------
    SceneError
        The scene cannot be simulated.
    ValueError
        The step follows the error, so that steps of the environment would not take the same time; a number is
        out of its range.

    Examples
    --------
    >>> scene = Scene.from_toml("scenes/cantilever_fem_2d.toml")
    >>> tip = lambda env: env.positions[:, -1, 1]
    >>> env = vector(scene, 2, action=ForceAction([79], axes="y"), observe=tip, reward=tip, substeps=10)
    >>> env.reset(seed=0)[0].shape
    (2, 1)
    """
    if (
        n < 1
        or substeps < 1
        or (max_steps is not None and max_steps < 1)
        or (threads is not None and threads < 1)
    ):
        raise ValueError(
            f"n, substeps, max_steps and threads are at least 1; got {n}, {substeps}, {max_steps}, {threads}"
        )
    if autoreset not in spaces.MODES:
        raise ValueError(f"autoreset is one of {', '.join(spaces.MODES)}; got {autoreset!r}")
    if on_failure not in ("terminate", "raise"):
        raise ValueError(f'on_failure is "terminate" or "raise", got {on_failure!r}')
    simulation = scene if isinstance(scene, Simulation) else Simulation(scene)
    if simulation.scene.step_size is None:
        raise ValueError(
            "the step of this scene follows the error; environments need steps of one size: "
            "give [time] `step`"
        )
    return spaces.kind_of_gymnasium(VectorEnvironment)(
        simulation,
        n,
        [action] if isinstance(action, Action) else action,
        [observe] if isinstance(observe, str) or callable(observe) else observe,
        reward,
        terminated,
        start,
        substeps,
        max_steps,
        autoreset,
        on_failure,
        threads or os.cpu_count() or 1,
        dtype,
    )
