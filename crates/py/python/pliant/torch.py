"""Runs in PyTorch: `simulate` is an autograd function (``pip install 'pliant[torch]'``)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import torch  # type: ignore[import-not-found, unused-ignore]

from ._differentiable import Array, Run
from ._pliant import Scene

__all__ = ["simulate"]


def simulate(
    scene: Scene,
    steps: int,
    *,
    position: torch.Tensor | None = None,
    velocity: torch.Tensor | None = None,
    parameters: Mapping[str, torch.Tensor] | None = None,
    every: int = 1,
    memory: int | None = None,
) -> tuple[torch.Tensor, torch.Tensor]:
    """Take steps of a scene; what follows can be differentiated by what went in.

    The way back is one sweep of `Simulation.gradient`, which takes the steps once more: exact derivatives of
    the steps that were taken. Steps run in double precision on the CPU; tensors of other types and devices
    are converted, and gradients come back as theirs.

    Parameters
    ----------
    scene : Scene
        What is simulated.
    steps : int
        How many steps are taken.
    position : Tensor, optional
        Positions at the start [m], shape (n, dim); those of the scene without it.
    velocity : Tensor, optional
        Velocities at the start [m/s], shape (n, dim); those of the scene without it.
    parameters : mapping of str to Tensor, optional
        Numbers of the scene in SI units by their names, ``{"body.beam.elastic.young": young}``, as
        `Simulation.gradient_names` has them; ``"world.gravity"`` has shape (dim,), a field of moduli,
        ``"body.beam.elastic.young_per_element"``, shape (elements,).
    every : int
        How many steps lie between states that are returned.
    memory : int, optional
        Bytes for states on the way back, as for `Simulation.gradient`.

    Returns
    -------
    tuple of Tensor
        Positions [m] and velocities [m/s] at the start and after every `every` steps, shape
        (steps / every + 1, n, dim) each.

    Raises
    ------
    KeyError
        A name has no derivative.
    ValueError
        `steps` is no multiple of `every`, or something in the scene has no derivative.
    StepError
        A step cannot be taken.
    """
    given = dict(parameters or {})
    run = Run(scene, steps, list(given), every, memory)
    start = [torch.tensor(part) for part in run.start]
    x = start[0] if position is None else position
    v = start[1] if velocity is None else velocity
    found: tuple[torch.Tensor, torch.Tensor] = _Simulate.apply(run, x, v, *given.values())
    return found


class _Simulate(torch.autograd.Function):
    """A run forwards and back."""

    @staticmethod
    def forward(ctx: Any, run: Run, *inputs: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
        ctx.run = run
        ctx.save_for_backward(*inputs)
        x, v, *parameters = map(_array, inputs)
        found = run.forward(x, v, parameters)
        return _tensor(found[0], inputs[0]), _tensor(found[1], inputs[0])

    @staticmethod
    @torch.autograd.function.once_differentiable
    def backward(ctx: Any, by_positions: torch.Tensor, by_velocities: torch.Tensor) -> tuple[Any, ...]:
        inputs = ctx.saved_tensors
        x, v, *parameters = map(_array, inputs)
        by_x, by_v, by = ctx.run.backward((x, v, parameters), _array(by_positions), _array(by_velocities))
        parts = zip([by_x, by_v, *by], inputs, strict=True)
        return None, *(_tensor(part, like) for part, like in parts)


def _array(tensor: torch.Tensor) -> Array:
    """As NumPy has it; the same memory where it is on the CPU in double precision."""
    return np.asarray(tensor.detach().to("cpu", torch.float64).numpy(), dtype=np.float64, order="C")


def _tensor(array: Array, like: torch.Tensor) -> torch.Tensor:
    return torch.from_numpy(np.asarray(array, order="C")).to(like)
