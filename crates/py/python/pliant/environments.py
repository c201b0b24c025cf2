"""Vector environments for reinforcement learning: many copies of one scene, for Gymnasium if installed."""

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

#: Observations by name.
OBSERVED = ("positions", "velocities", "displacements", "probes", "reactions", "contacts", "time", "actions")


class VectorEnvironment:
    """Copies of a simulation that step together; made by `vector`.

    If Gymnasium is installed, this class is a ``gymnasium.vector.VectorEnv``, with spaces of Gymnasium. The
    first axis of all arrays counts the n environments.

    Attributes
    ----------
    num_envs : int
        Number of environments, n.
    single_action_space, action_space : Box
        Action spaces of one environment, shape (k,), and of all, shape (n, k).
    single_observation_space, observation_space : Box
        Observation spaces of one environment, shape (m,), and of all, shape (n, m).
    positions, velocities : ndarray of float64, shape (n, vertices, dim)
        Current positions [m] and velocities [m/s] of all environments, read only: one contiguous array each,
        the same object each time.
    previous_positions : ndarray of float64, shape (n, vertices, dim)
        Positions before the last step of the environment [m].
    rest_positions : ndarray of float64, shape (vertices, dim)
        Rest positions [m].
    actions : ndarray of float64, shape (n, k)
        Last actions, clipped to their bounds; zero after a reset.
    elapsed : ndarray of int64, shape (n,)
        Number of steps of the environment since the last reset.
    step_duration : float
        Simulated time of a step of the environment [s].
    scene : Scene
        The scene.

    Notes
    -----
    Copies step on threads that release the GIL, each copy on one thread at a time: positions are
    bit-identical to those of a single simulation, for any number of threads.

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
        """Return the components in this dimension: in 2D two of the force, one of the moment."""
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
        """Measure the current reaction forces of pins and walls.

        Parameters
        ----------
        name : str, optional
            Name of one, ``body/pin`` or ``wall0``; default: all, in order.

        Returns
        -------
        ndarray of float64, shape (n, names, 2, 3), or (n, 2, 3) of one
            Force [N] and moment [N m], as in `Simulation.reactions`; zero after the release of a pin.

        Examples
        --------
        >>> env.reactions("beam/left").shape
        (2, 2, 3)
        """
        return _one(*self._batch.reactions(), name, "pin or wall")

    def probes(self, name: str | None = None) -> Array:
        """Measure the current positions and velocities of the probes of the scene.

        Parameters
        ----------
        name : str, optional
            Name of one; default: all, in order.

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
        """Sum the current normal and friction forces of contact on bodies.

        Parameters
        ----------
        body : str, optional
            Name of one; default: all, in order.

        Returns
        -------
        ndarray of float64, shape (n, bodies, 3), or (n, 3) of one
            Forces [N]; zero without ``[contact]``.

        Examples
        --------
        >>> env.contact_forces("beam")
        array([[0., 0., 0.],
               [0., 0., 0.]])
        """
        return _one(*self._batch.contact_forces(), body, "body")

    def simulation(self, number: int) -> Simulation:
        """Make a simulation that continues from the state of an environment, to view, record or measure it.

        Parameters
        ----------
        number : int
            Number of the environment.

        Returns
        -------
        Simulation
            Simulation in the same state, with the same values, pins and forces. Solvers of implicit
            integrators are reset, in the environment too.

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
        """Reset environments to their start.

        Parameters
        ----------
        seed : int or list of int, optional
            Seed of the generators that `start` gets: ``seed + i`` for environment i, or entry i; default: the
            generators continue.
        options : dict, optional
            ``"reset_mask"``: an array of bool, shape (n,), of the environments to reset; default: all.

        Returns
        -------
        observations : ndarray, shape (n, m)
            Observations of all environments.
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
        """Advance every environment by one step: `substeps` steps of its simulation.

        Parameters
        ----------
        actions : array_like, shape (n, k)
            Actions; values out of bounds are clipped.

        Returns
        -------
        observations : ndarray, shape (n, m)
            Observations after the step.
        rewards : ndarray of float64, shape (n,)
            Rewards of the step, from `reward`.
        terminated : ndarray of bool, shape (n,)
            True for environments whose episode has ended, a failed step included.
        truncated : ndarray of bool, shape (n,)
            True for environments whose episode has reached `max_steps`.
        info : dict
            ``"time"``, shape (n,). After failed steps also ``"failure"``, the messages, ``"failure_step"``
            and ``"failure_time"``, each of shape (n,), and a mask ``"_failure"``. After resets in this step
            (``"same-step"``) also ``"final_obs"`` and ``"final_info"``.

        Raises
        ------
        ValueError
            An action has the wrong shape or is not finite; an environment has ended and was not reset
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
        """Close the environments; no resources need to be freed.

        Parameters
        ----------
        **_options
            Ignored.

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
    """Make many environments of one scene that step together, for reinforcement learning.

    Parameters
    ----------
    scene : Scene or Simulation
        The scene, or a simulation whose state, pins, forces and materials are copied.
    n : int
        Number of environments.
    action : PinAction, ForceAction, FunctionAction, ValueAction, or a list of them
        Meaning of the actions; the numbers of several are concatenated.
    observe : str or callable, or a list of them
        Observations. Names: "positions", "velocities", "displacements" (from the reference configuration),
        "probes", "reactions" (of pins and walls), "contacts" (contact force on each body),
        ``"reactions:NAME"`` for one of them, "time", "actions". Functions of the `VectorEnvironment` return
        arrays of shape (n, ..).
    reward : callable, optional
        Function of the `VectorEnvironment` that returns rewards of shape (n,); default: zero.
    terminated : callable, optional
        Function of the `VectorEnvironment` that returns True where an episode has ended: bool, shape (n,).
    start : callable, optional
        Called for each environment that is reset, with its `numpy.random.Generator` and the initial positions
        [m] and velocities [m/s], shape (vertices, dim); returns the positions and velocities to start with.
    substeps : int, default 1
        Number of steps of the simulation per step of the environment.
    max_steps : int, optional
        Number of steps after which an episode is truncated.
    autoreset : {"next-step", "same-step", "disabled"}
        Gymnasium's mode of resetting environments that have ended: in the next step, which ignores the
        action; in the same step, whose observation is then the initial one; or only by `reset`.
    on_failure : {"terminate", "raise"}
        Reaction to a failed step: end this environment, with a warning and the reason in ``info``, while
        others continue; or raise the `StepError`.
    threads : int, optional
        Number of threads; default: all processors. Results do not depend on it.
    dtype : dtype, default float32
        Data type of observations.

    Returns
    -------
    VectorEnvironment
        The environments; also a ``gymnasium.vector.VectorEnv`` if Gymnasium is installed.

    Raises
    ------
    SceneError
        The scene cannot be simulated.
    ValueError
        The step size is adaptive, so that steps of the environment would differ in duration; a number is out
        of range.

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
            "the step size of this scene is adaptive; environments need a fixed step: give [time] `step`"
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
