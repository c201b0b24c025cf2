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
    """Run steps of a scene as a differentiable function.

    The backward pass is one sweep of `Simulation.gradient`, which repeats the steps: exact derivatives of the
    computed steps. Steps run in double precision on the CPU; tensors of other types and devices are
    converted, and gradients have the type and device of their tensor.

    Parameters
    ----------
    scene : Scene
        The scene.
    steps : int
        Number of steps.
    position : Tensor, optional
        Initial positions [m], shape (n, dim); default: those of the scene.
    velocity : Tensor, optional
        Initial velocities [m/s], shape (n, dim); default: those of the scene.
    parameters : mapping of str to Tensor, optional
        Parameters of the scene in SI units by name, ``{"body.beam.elastic.young": young}``, from
        `Simulation.gradient_names`; ``"world.gravity"`` has shape (dim,),
        ``"body.beam.elastic.young_per_element"`` shape (elements,).
    every : int
        Number of steps between returned states.
    memory : int, optional
        Bytes for stored states in the backward sweep, as in `Simulation.gradient`.

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
        A step fails.
    """
    given = dict(parameters or {})
    run = Run(scene, steps, list(given), every, memory)
    start = [torch.tensor(part) for part in run.start]
    x = start[0] if position is None else position
    v = start[1] if velocity is None else velocity
    found: tuple[torch.Tensor, torch.Tensor] = _Simulate.apply(run, x, v, *given.values())
    return found


class _Simulate(torch.autograd.Function):
    """Forward and backward pass of a run."""

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
    """Return a NumPy array, without a copy if the tensor is on the CPU in double precision."""
    return np.asarray(tensor.detach().to("cpu", torch.float64).numpy(), dtype=np.float64, order="C")


def _tensor(array: Array, like: torch.Tensor) -> torch.Tensor:
    return torch.from_numpy(np.asarray(array, order="C")).to(like)
