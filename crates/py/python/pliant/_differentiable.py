"""Runs as differentiable functions, for libraries with automatic differentiation."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from ._pliant import Frame, Scene, Simulation

Array = npt.NDArray[np.float64]

#: Ends the names of moduli that are arrays, one number for each element.
OF_EACH = ".young_per_element"


class Run:
    """Run of a scene, as a function of its initial state and of its parameters.

    Parameters
    ----------
    scene : Scene
        The scene; parameters that are not arguments keep its values.
    steps : int
        Number of steps.
    names : sequence of str
        Keys of the scene that are arguments, from `Simulation.gradient_names`: a number, a vector such as
        `world.gravity`, or Young's modulus of each element.
    every : int
        Number of steps between returned states.
    memory : int, optional
        Bytes for stored states in the backward sweep, as in `Simulation.gradient`.
    """

    def __init__(
        self, scene: Scene, steps: int, names: Sequence[str], every: int, memory: int | None
    ) -> None:
        if every < 1 or steps < 0 or steps % every:
            found = f"got {steps} and {every}"
            raise ValueError(f"steps must be a multiple of every, which is 1 or more; {found}")
        simulation = Simulation(scene)
        known = [name for name in simulation.gradient_names() if _may_be_a_key(name)]
        for name in names:
            if name not in known:
                raise KeyError(f"`{name}` has no derivative; these have one: {', '.join(known)}")
        self.scene, self.steps, self.names = scene, steps, list(names)
        self.every, self.memory = every, memory
        self.paths = {name: _path(scene, name) for name in names}
        self.start = (simulation.positions, simulation.velocities)
        #: Shape of the positions that are returned, and of the velocities: (frames, n, dim).
        self.shape = (steps // every + 1, *self.start[0].shape)

    def simulation(self, position: Array, velocity: Array, parameters: Sequence[Array]) -> Simulation:
        """Return the simulation at its start."""
        changes = {}
        for name, value in zip(self.names, parameters, strict=True):
            if value.ndim == 0 and name.endswith(OF_EACH):
                raise ValueError(f"`{name}` has one number for each element, got the number {float(value)}")
            changes[self.paths[name]] = float(value) if value.ndim == 0 else value.tolist()
        simulation = Simulation(self.scene.with_changes(changes) if changes else self.scene)
        simulation.positions, simulation.velocities = position, velocity
        return simulation

    def forward(self, position: Array, velocity: Array, parameters: Sequence[Array]) -> tuple[Array, Array]:
        """Return positions and velocities of all frames."""
        simulation = self.simulation(position, velocity, parameters)
        x, v = np.empty(self.shape), np.empty(self.shape)
        x[0], v[0] = simulation.positions, simulation.velocities
        for k in range(1, self.shape[0]):
            simulation.step(self.every)
            x[k], v[k] = simulation.positions, simulation.velocities
        return x, v

    def backward(
        self,
        inputs: tuple[Array, Array, Sequence[Array]],
        by_positions: Array,
        by_velocities: Array,
    ) -> tuple[Array, Array, list[Array]]:
        """Return derivatives by the arguments, from those by the returned positions and velocities."""
        position, velocity, parameters = inputs

        def loss(frame: Frame) -> tuple[Any, ...] | None:
            if frame.index % self.every:
                return None
            k = frame.index // self.every
            return 0.0, by_positions[k], by_velocities[k]

        simulation = self.simulation(position, velocity, parameters)
        names = ["position", "velocity", *self.names]
        gradient = simulation.gradient(loss, names, steps=self.steps, memory=self.memory)
        parts = [np.asarray(gradient[name], dtype=np.float64) for name in names]
        shaped = [part.reshape(value.shape) for part, value in zip(parts[2:], parameters, strict=True)]
        return parts[0], parts[1], shaped


def _may_be_a_key(name: str) -> bool:
    """Return False for names without a key: states, arrays over the run, factors of formulas."""
    return name not in ("position", "velocity", "forces", "pins") and not name.endswith(".factor")


def _path(scene: Scene, name: str) -> str:
    """Return the path of a parameter in the scene, from its name among the derivatives."""
    if name == "world.gravity":
        return name
    if name.endswith(OF_EACH):
        return scene._path(name.removesuffix("_per_element"))
    if name.endswith((".rest", "_per_element", ".per_vertex")):
        message = f"`{name}` is many numbers, which no key of a scene is; `Simulation.gradient` has them"
        raise ValueError(message)
    try:
        return scene._path(name)
    except KeyError:
        # A vector is set as a whole.
        try:
            return scene._path(f"{name}.0").removesuffix(".0")
        except KeyError:
            pass
        raise
