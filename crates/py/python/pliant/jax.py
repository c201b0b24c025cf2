"""Runs in JAX: `simulate` has a custom derivative (``pip install 'pliant[jax]'``)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import jax  # type: ignore[import-not-found, unused-ignore]
import jax.numpy as jnp  # type: ignore[import-not-found, unused-ignore]
import numpy as np

from ._differentiable import Array, Run
from ._pliant import Scene

__all__ = ["simulate"]


def simulate(
    scene: Scene,
    steps: int,
    *,
    position: jax.Array | None = None,
    velocity: jax.Array | None = None,
    parameters: Mapping[str, jax.Array] | None = None,
    every: int = 1,
    memory: int | None = None,
) -> tuple[jax.Array, jax.Array]:
    """Run steps of a scene as a differentiable function.

    The backward pass is one sweep of `Simulation.gradient`, which repeats the steps: exact derivatives of the
    computed steps. It works under `jax.jit`, where steps are a callback (`jax.pure_callback`), and with
    `jax.grad` and `jax.vjp`. There are no forward derivatives (`jax.jvp`), and `jax.vmap` computes one run
    after the other.

    Steps run in double precision on the CPU. JAX rounds inputs and outputs to single precision unless
    ``jax.config.update("jax_enable_x64", True)`` is set.

    Parameters
    ----------
    scene : Scene
        The scene.
    steps : int
        Number of steps.
    position : Array, optional
        Initial positions [m], shape (n, dim); default: those of the scene.
    velocity : Array, optional
        Initial velocities [m/s], shape (n, dim); default: those of the scene.
    parameters : mapping of str to Array, optional
        Parameters of the scene in SI units by name, ``{"body.beam.elastic.young": young}``, from
        `Simulation.gradient_names`; ``"world.gravity"`` has shape (dim,),
        ``"body.beam.elastic.young_per_element"`` shape (elements,).
    every : int
        Number of steps between returned states.
    memory : int, optional
        Bytes for stored states in the backward sweep, as in `Simulation.gradient`.

    Returns
    -------
    tuple of Array
        Positions [m] and velocities [m/s] at the start and after every `every` steps, shape
        (steps / every + 1, n, dim) each.

    Raises
    ------
    KeyError
        A name has no derivative.
    ValueError
        `steps` is no multiple of `every`, or something in the scene has no derivative. A failed step raises
        JAX's `JaxRuntimeError`, with the message of the `StepError`.
    """
    given = {name: jnp.asarray(value) for name, value in dict(parameters or {}).items()}
    run = Run(scene, steps, list(given), every, memory)
    x = jnp.asarray(run.start[0] if position is None else position)
    v = jnp.asarray(run.start[1] if velocity is None else velocity)
    kind = x.dtype
    frames = jax.ShapeDtypeStruct(run.shape, kind)

    def forward(x: Any, v: Any, parameters: Any) -> tuple[Any, ...]:
        found = run.forward(_array(x), _array(v), [_array(value) for value in parameters])
        return tuple(part.astype(kind) for part in found)

    def backward(inputs: Any, by_positions: Any, by_velocities: Any) -> Any:
        x, v, parameters = inputs
        numbers = [_array(value) for value in parameters]
        found = run.backward((_array(x), _array(v), numbers), _array(by_positions), _array(by_velocities))
        by_x, by_v, by = found
        return (
            by_x.astype(x.dtype),
            by_v.astype(v.dtype),
            [part.astype(value.dtype) for part, value in zip(by, parameters, strict=True)],
        )

    @jax.custom_vjp
    def simulated(x: Any, v: Any, parameters: Any) -> Any:
        return jax.pure_callback(forward, (frames, frames), x, v, parameters, vmap_method="sequential")

    def there(x: Any, v: Any, parameters: Any) -> Any:
        return simulated(x, v, parameters), (x, v, parameters)

    def back(inputs: Any, by: Any) -> Any:
        like = jax.tree.map(lambda value: jax.ShapeDtypeStruct(value.shape, value.dtype), inputs)
        return jax.pure_callback(backward, like, inputs, *by, vmap_method="sequential")

    simulated.defvjp(there, back)
    found: tuple[jax.Array, jax.Array] = simulated(x, v, list(given.values()))
    return found


def _array(value: Any) -> Array:
    return np.asarray(value, dtype=np.float64, order="C")
