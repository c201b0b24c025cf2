"""`pliant.jax` and `pliant.torch`, where these libraries are installed: against differences of runs."""

from __future__ import annotations

from typing import Any

import numpy as np
import pliant
import pytest
from conftest import beam

YOUNG = "body.beam.elastic.young"
STEPS = 40
NAMES = ["position", "velocity", YOUNG, "world.gravity"]


def loss(library: Any, x: Any, v: Any) -> Any:
    """Some number that all frames have a part in."""
    weights = library.asarray(np.arange(x.shape[0]) / STEPS)
    return (weights[:, None, None] * x**2).sum() + 0.1 * (v[-1] ** 2).sum()


def value(inputs: list[np.ndarray]) -> float:
    """The same by a run without any of these libraries."""
    changes = {"body.0.elastic.corotated.young": float(inputs[2]), "world.gravity": inputs[3].tolist()}
    simulation = pliant.Simulation(beam(**changes))
    simulation.positions, simulation.velocities = inputs[0], inputs[1]
    frames = [(simulation.positions, simulation.velocities)]
    for _ in range(STEPS // 10):
        simulation.step(10)
        frames.append((simulation.positions, simulation.velocities))
    return float(loss(np, np.array([x for x, _ in frames]), np.array([v for _, v in frames])))


def start() -> list[np.ndarray]:
    simulation = pliant.Simulation(beam())
    velocity = 0.1 * np.sin(np.arange(simulation.positions.size)).reshape(simulation.positions.shape)
    velocity[:2] = 0.0
    return [simulation.positions, velocity, np.array(1e5), np.array([0.3, -9.8])]


def check(gradients: list[np.ndarray]) -> None:
    """Each against the difference along a direction, at a step where that has nine digits."""
    for i, gradient in enumerate(gradients):
        inputs = start()
        assert gradient.shape == inputs[i].shape
        direction = np.cos(np.arange(max(inputs[i].size, 1), dtype=float)).reshape(inputs[i].shape)
        if i < 2:
            # Held vertices stay where they are.
            direction[:2] = 0.0
        size = (1e-6 if i < 2 else 1e-4) * max(float(np.abs(inputs[i]).max()), 0.1)
        values = []
        for sign in (1.0, -1.0):
            changed = start()
            changed[i] = changed[i] + sign * size * direction
            values.append(value(changed))
        difference = (values[0] - values[1]) / (2.0 * size)
        assert np.sum(gradient * direction) == pytest.approx(difference, rel=1e-6), NAMES[i]


def test_jax_has_the_derivatives_of_differences() -> None:
    jax = pytest.importorskip("jax")
    jax.config.update("jax_enable_x64", True)
    from pliant.jax import simulate

    def total(x: Any, v: Any, young: Any, gravity: Any) -> Any:
        parameters = {YOUNG: young, "world.gravity": gravity}
        frames = simulate(beam(), STEPS, position=x, velocity=v, parameters=parameters, every=10)
        return loss(jax.numpy, *frames)

    found, gradients = jax.value_and_grad(total, argnums=(0, 1, 2, 3))(*start())
    assert float(found) == pytest.approx(value(start()), rel=1e-14)
    check([np.asarray(gradient) for gradient in gradients])
    compiled = jax.jit(jax.grad(total, argnums=2))(*start())
    assert float(compiled) == float(gradients[2])
    twice = jax.vmap(lambda young: total(start()[0], start()[1], young, start()[3]))(np.array([1e5, 1e5]))
    assert np.asarray(twice).tolist() == [float(found)] * 2


def test_torch_has_the_derivatives_of_differences() -> None:
    torch = pytest.importorskip("torch")
    from pliant.torch import simulate

    x, v, young, gravity = (torch.tensor(part, requires_grad=True) for part in start())
    parameters = {YOUNG: young, "world.gravity": gravity}
    frames = simulate(beam(), STEPS, position=x, velocity=v, parameters=parameters, every=10)
    total = loss(torch, *frames)
    assert total.item() == pytest.approx(value(start()), rel=1e-14)
    total.backward()
    check([part.grad.numpy() for part in (x, v, young, gravity)])
    single = torch.tensor(1e5, requires_grad=True)
    loss(torch, *simulate(beam(), STEPS, parameters={YOUNG: single})).backward()
    assert single.grad.dtype == torch.float32


def test_the_vector_of_a_load_is_an_argument_and_what_is_no_key_of_the_scene_is_none() -> None:
    jax = pytest.importorskip("jax")
    jax.config.update("jax_enable_x64", True)
    from pliant.jax import simulate

    loaded = beam(**{"body.0.load": [{"vertices": [3], "force": [0.0, -1.0]}]})
    name = "body.beam.load.0.force"

    def height(force: Any) -> Any:
        return simulate(loaded, 5, parameters={name: force})[0][-1, 3, 1]

    force, size = np.array([0.0, -1.0]), 1e-3
    found = np.asarray(jax.grad(height)(force))
    for direction in np.eye(2):
        ahead, behind = (float(height(force + sign * size * direction)) for sign in (1.0, -1.0))
        assert found @ direction == pytest.approx((ahead - behind) / (2.0 * size), rel=1e-5)
    for other in ("forces", "pins", "body.beam.load.0.factor"):
        with pytest.raises(KeyError, match=f"`{other}` has no derivative; these have one: world") as error:
            simulate(loaded, 1, parameters={other: np.array(1.0)})
        assert "factor," not in str(error.value)


@pytest.mark.parametrize("library", ["jax", "torch"])
def test_names_that_are_none_are_answered_with_those_that_are(library: str) -> None:
    pytest.importorskip(library)
    simulate = __import__(f"pliant.{library}", fromlist=["simulate"]).simulate
    known = r"`time\.step` has no derivative; these have one: world\.gravity, body\.beam"
    with pytest.raises(KeyError, match=known):
        simulate(beam(), 1, parameters={"time.step": np.array(1e-3)})
    with pytest.raises(ValueError, match="a multiple of every"):
        simulate(beam(), 3, every=2)
    with pytest.raises(ValueError, match="many numbers"):
        simulate(beam(), 1, parameters={"body.beam.elastic.poisson_per_element": np.ones(8)})


@pytest.mark.parametrize("library", ["jax", "torch"])
def test_a_field_of_moduli_is_an_argument(library: str) -> None:
    pytest.importorskip(library)
    simulate = __import__(f"pliant.{library}", fromlist=["simulate"]).simulate
    name = f"{YOUNG}_per_element"
    moduli = np.linspace(5e4, 1e5, 8)

    def height(changed: np.ndarray) -> float:
        simulation = pliant.Simulation(beam(**{"body.0.elastic.corotated.young": changed}))
        simulation.step(20)
        return float(simulation.positions[-1, 1])

    if library == "jax":
        import jax

        jax.config.update("jax_enable_x64", True)
        take = jax.value_and_grad(lambda each: simulate(beam(), 20, parameters={name: each})[0][-1, -1, 1])
        found, gradient = (np.asarray(part) for part in take(moduli))
    else:
        import torch

        each = torch.tensor(moduli, requires_grad=True)
        tip = simulate(beam(), 20, parameters={name: each})[0][-1, -1, 1]
        tip.backward()
        found, gradient = tip.detach().numpy(), each.grad.numpy()
    assert float(found) == height(moduli) and gradient.shape == moduli.shape
    for k in range(8):
        change = 1e-4 * moduli[k] * np.eye(8)[k]
        difference = (height(moduli + change) - height(moduli - change)) / (2e-4 * moduli[k])
        assert gradient[k] == pytest.approx(difference, rel=1e-5, abs=1e-5 * np.abs(gradient).max()), k
    message = f"`{name}` has one number for each element, got the number 100000"
    with pytest.raises(Exception, match=message):
        one = np.array(1e5) if library == "jax" else __import__("torch").tensor(1e5)
        simulate(beam(), 1, parameters={name: one})
