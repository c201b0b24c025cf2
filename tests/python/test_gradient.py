"""Gradients of runs against differences of runs, and what is refused."""

from __future__ import annotations

import numpy as np
import pliant
import pytest
from conftest import beam


def tip(frame: pliant.Frame) -> tuple[float, np.ndarray] | None:
    """Height of the last vertex after 20 steps."""
    return tip_at(frame, 20)


def test_derivatives_are_those_of_differences() -> None:
    simulation = pliant.Simulation(beam())
    names = simulation.gradient_names()
    young = next(name for name in names if name.endswith("elastic.young"))
    gradient = simulation.gradient(tip, [young, "velocity", "world.gravity"], steps=20)
    assert simulation.steps == 20 and gradient.value == simulation.positions[-1, 1]
    assert isinstance(gradient[young], float) and list(gradient) == [young, "velocity", "world.gravity"]
    assert gradient["velocity"].shape == simulation.positions.shape
    assert gradient["world.gravity"].shape == (2,)
    heights = []
    for change in (1e-5, -1e-5):
        other = pliant.Simulation(beam())
        other.velocities = other.velocities + change * np.eye(10, 2, k=-8)
        other.step(20)
        heights.append(other.positions[-1, 1])
    difference = (heights[0] - heights[1]) / 2e-5
    expected = gradient["velocity"][8, 0] + gradient["velocity"][9, 1]
    assert difference == pytest.approx(expected, rel=1e-6, abs=1e-9)


def test_products_with_the_jacobian_are_the_transpose_of_gradients() -> None:
    forwards = pliant.Simulation(beam())
    x, v = (np.sin(np.arange(20.0) + seed).reshape(10, 2) for seed in (1, 2))
    by_x, by_v = forwards.jvp(x, v, steps=20)
    assert forwards.steps == 20 and by_x.shape == by_v.shape == (10, 2)
    gradient = pliant.Simulation(beam()).gradient(tip, ["position", "velocity"], steps=20)
    assert np.sum(gradient["position"] * x) + np.sum(gradient["velocity"] * v) == pytest.approx(
        by_x[-1, 1], rel=1e-11
    )
    np.testing.assert_array_equal(by_v[:2], 0.0)
    only_v = pliant.Simulation(beam()).jvp(velocity=v, steps=20)[0]
    np.testing.assert_allclose(only_v + pliant.Simulation(beam()).jvp(x, steps=20)[0], by_x, atol=1e-12)
    with pytest.raises(ValueError, match=r"change of positions must have shape \(10, 2\)"):
        forwards.jvp(np.zeros(3))


def test_tangents_by_parameters_and_gauss_newton_products() -> None:
    names = ["body.beam.elastic.young", "world.gravity", "forces", "velocity"]
    gradient = pliant.Simulation(beam()).gradient(tip, names, steps=20)
    along = {
        "body.beam.elastic.young": 1e3,
        "world.gravity": [0.2, -0.3],
        "forces": np.sin(np.arange(400.0)).reshape(20, 10, 2),
    }
    velocity = np.cos(np.arange(20.0)).reshape(10, 2)
    by_position, _ = pliant.Simulation(beam()).jvp(velocity=velocity, parameters=along, steps=20)
    expected = sum(
        np.sum(gradient[name] * np.asarray(change))
        for name, change in {**along, "velocity": velocity}.items()
    )
    assert by_position[-1, 1] == pytest.approx(expected, rel=1e-11)

    def curvature(frame: pliant.Frame, dx: np.ndarray, dv: np.ndarray) -> np.ndarray | None:
        if frame.index < 20:
            return None
        product = np.zeros_like(dx)
        product[-1, 1] = dx[-1, 1]
        return product

    direction = {**along, "velocity": velocity}
    found = pliant.Simulation(beam()).gauss_newton_product(curvature, direction, steps=20)
    # Of one residual it is the gradient times the change.
    assert list(found) == list(direction) and found.value == pytest.approx(expected**2, rel=1e-10)
    for name in names:
        np.testing.assert_allclose(found[name], gradient[name] * expected, rtol=1e-9, atol=1e-15)
    with pytest.raises(KeyError, match="no_such"):
        pliant.Simulation(beam()).jvp(parameters={"no_such": 1.0}, steps=1)
    with pytest.raises(ValueError, match="by parameter 0"):
        pliant.Simulation(beam()).jvp(parameters={"pins": np.zeros((2, 10, 2))}, steps=1)
    with pytest.raises(ValueError, match=r"world.gravity must have shape \(2,\)"):
        pliant.Simulation(beam()).jvp(parameters={"world.gravity": 1.0}, steps=1)
    with pytest.raises(ZeroDivisionError):
        pliant.Simulation(beam()).gauss_newton_product(
            lambda frame, dx, dv: 1 / 0, {"world.gravity": [0, 1]}, steps=1
        )
    with pytest.raises(TypeError, match="a curvature returns"):
        pliant.Simulation(beam()).gauss_newton_product(
            lambda frame, dx, dv: (dx,), {"world.gravity": [0, 1]}, steps=1
        )


def test_products_with_the_hessian_are_symmetric_and_differences_of_gradients() -> None:
    def squares(frame: pliant.Frame) -> tuple[float, np.ndarray] | None:
        return None if frame.index < 20 else (np.sum(frame.positions**2), 2.0 * frame.positions)

    young, gravity = "body.beam.elastic.young", "world.gravity"
    velocities = [np.sin(np.arange(20.0) + seed).reshape(10, 2) for seed in (1, 2)]
    first = {young: 1e5, "velocity": velocities[0], gravity: [1.0, -2.0]}
    second = {young: -2e5, "velocity": velocities[1], gravity: [0.5, 3.0]}
    simulation = pliant.Simulation(beam())
    of_first, of_second = (
        simulation.hessian_product(squares, direction, steps=20) for direction in (first, second)
    )
    assert simulation.steps == 0 and list(of_first) == list(first)
    assert isinstance(of_first[young], float) and of_first["velocity"].shape == (10, 2)
    one = sum(np.sum(of_first[name] * np.asarray(change)) for name, change in second.items())
    other = sum(np.sum(of_second[name] * np.asarray(change)) for name, change in first.items())
    assert one == pytest.approx(other, rel=1e-7)
    assert of_first.value == pytest.approx(
        sum(np.sum(of_first[name] * np.asarray(first[name])) for name in first)
    )
    # The length of the direction does not matter.
    longer = simulation.hessian_product(
        squares, {name: 1e3 * np.asarray(change) for name, change in first.items()}, steps=20
    )
    assert longer.value == pytest.approx(1e6 * of_first.value, rel=1e-7)
    by = []
    for change in (1e3, -1e3):
        other_modulus = pliant.Simulation(beam())
        value = other_modulus.scene._value(other_modulus.scene._path(young))
        other_modulus.set({other_modulus.scene._path(young): value + change})
        by.append(other_modulus.gradient(squares, [young], steps=20)[young])
    found = simulation.hessian_product(squares, {young: 1.0}, steps=20)
    assert found[young] == pytest.approx((by[0] - by[1]) / 2e3, rel=1e-5)
    assert found.errors[young] < 1e-6 * abs(found[young])
    end = 20 * simulation.scene._value("time.step")
    assert simulation.hessian_product(squares, {young: 1.0}, times=[0.5 * end, end])[young] == found[young]
    with pytest.raises(ValueError, match="not both"):
        simulation.hessian_product(squares, {young: 1.0}, steps=20, times=[end])
    with pytest.raises(KeyError, match="no_such"):
        simulation.hessian_product(squares, {"no_such": 1.0}, steps=1)
    with pytest.raises(KeyError, match="could be changed"):
        simulation.hessian_product(squares, {"forces": np.zeros((1, 10, 2))}, steps=1)
    with pytest.raises(ValueError, match=r"world.gravity must have shape \(2,\)"):
        simulation.hessian_product(squares, {gravity: 1.0}, steps=1)
    with pytest.raises(ValueError, match="reach must be above zero"):
        simulation.hessian_product(squares, {young: 1.0}, steps=1, reach=0.0)


def net(**numbers: float) -> pliant.Scene:
    """A chain whose end is shaken, its pin, its gravity and its dashpots by formulas of named numbers."""
    at = {"A": 0.02, "w": 25.0, "g": 9.81, "c": 0.4, "d": 3.0, **numbers}
    motion = {"displacement": ["0", "A*sin(w*t) where A = {A!r}, w = {w!r}".format(**at)]}
    formula = {"dissipation": "c/2*rate^2 + d/4*rate^4", "parameters": {"c": at["c"], "d": at["d"]}}
    return pliant.Scene(
        dimension=2,
        time={"integrator": "implicit-euler", "step": 0.01, "duration": 1.0, "solver": {"tolerance": 1e-14}},
        world={"gravity": ["0", "-g*(1 + t) where g = {g!r}".format(**at)]},
        body=[
            {
                "name": "net",
                "mesh": {"strand": {"segments": 4, "start": [0, 0], "end": [0.5, 0.2]}},
                "springs": {"stiffness": 60.0},
                "mass": {"per_vertex": 0.2},
                "damping": {"expression": formula},
                "pin": [{"vertices": [0], "motion": motion}],
            }
        ],
    )


def test_numbers_that_formulas_name() -> None:
    of_pin, of_dashpots = "body.net.pin.0.motion.parameters.", "body.net.damping.expression.parameters."
    names = {
        "A": of_pin + "A",
        "w": of_pin + "w",
        "g": "world.gravity.parameters.g",
        "c": of_dashpots + "c",
        "d": of_dashpots + "d",
    }
    start = pliant.Simulation(net())
    assert set(names.values()) <= set(start.gradient_names())
    gradient = start.gradient(tip, list(names.values()), steps=20)
    at = {"A": 0.02, "w": 25.0, "g": 9.81, "c": 0.4, "d": 3.0}
    for key, value in at.items():
        heights = []
        for change in (1e-4 * value, -1e-4 * value):
            moved = pliant.Simulation(net(**{key: value + change}))
            moved.step(20)
            heights.append(moved.positions[-1, 1])
        difference = (heights[0] - heights[1]) / (2e-4 * value)
        assert gradient[names[key]] == pytest.approx(difference, rel=1e-5), key
    # Damping that follows positions has tangents.
    velocity = np.cos(np.arange(10.0)).reshape(5, 2)
    velocity[0] = 0.0
    by_position, _ = pliant.Simulation(net()).jvp(velocity=velocity, parameters={names["d"]: 2.0}, steps=20)
    back = pliant.Simulation(net()).gradient(tip, ["velocity", names["d"]], steps=20)
    assert by_position[-1, 1] == pytest.approx(
        np.sum(back["velocity"] * velocity) + 2.0 * back[names["d"]], rel=1e-10
    )


def test_memory_changes_no_bit() -> None:
    all_states = pliant.Simulation(beam()).gradient(tip, ["position"], steps=20)
    few = pliant.Simulation(beam()).gradient(tip, ["position"], steps=20, memory=2000)
    np.testing.assert_array_equal(all_states["position"], few["position"])


def test_steps_that_follow_the_error_land_on_times() -> None:
    scene = beam(
        **{"time": {"integrator": "dormand-prince5", "adaptive": {"tolerance": 1e-5}, "duration": 0.1}}
    )
    times = []

    def last(frame: pliant.Frame) -> tuple[float, np.ndarray] | None:
        times.append(frame.time)
        if frame.time < 0.02:
            return None
        return frame.positions[-1, 1], np.eye(10, 2, k=-8) * [0, 1]

    simulation = pliant.Simulation(scene)
    found = simulation.gradient(last, ["velocity"], times=[0.01, 0.02])
    assert simulation.time == 0.02 and 0.01 in times and found.value == simulation.positions[-1, 1]
    change = np.cos(np.arange(20.0)).reshape(10, 2)
    by_position, _ = pliant.Simulation(scene).jvp(velocity=change, steps=5)
    back = pliant.Simulation(scene).gradient(lambda frame: tip_at(frame, 5), ["velocity"], steps=5)
    assert by_position[-1, 1] == pytest.approx(np.sum(back["velocity"] * change), rel=1e-10)
    with pytest.raises(ValueError, match="give `steps`: the step size is adaptive"):
        pliant.Simulation(scene).jvp(velocity=change)
    with pytest.raises(ValueError, match=r"give `steps` or `times`, not both"):
        simulation.gradient(last, ["velocity"], steps=1, times=[0.01])
    with pytest.raises(ValueError, match=r"times must ascend; got 0.2 before 0.1"):
        simulation.gradient(last, ["velocity"], times=[0.2, 0.1])
    with pytest.raises(ValueError, match=r"at least one time"):
        simulation.gradient(last, ["velocity"], times=[])
    for times in ([float("nan")], [0.1, float("inf")], [-0.1, 0.2]):
        with pytest.raises(ValueError, match=r"times must be finite, and not before the present one"):
            simulation.gradient(last, ["velocity"], times=times)


def tip_at(frame: pliant.Frame, index: int) -> tuple[float, np.ndarray] | None:
    """Height of the last vertex after `index` steps."""
    by = np.zeros_like(frame.positions)
    by[-1, 1] = 1.0
    return (frame.positions[-1, 1], by) if frame.index == index else None


def test_walls_and_what_happens_at_each_step() -> None:
    floor = {"normal": [0.0, 1.0], "offset": -0.005}
    scene = beam(**{"world.walls": [floor], "body.0.load": [{"force": [0.0, -2.0]}]})
    names = ["forces", "pins", "body.beam.load.0.force", "velocity"]
    found = pliant.Simulation(scene).gradient(tip, names, steps=20)
    assert found["forces"].shape == (20, 10, 2) and found["pins"].shape == (21, 10, 2)
    # A force on every vertex in every step is the load, shared by ten.
    np.testing.assert_allclose(
        found["forces"].sum(axis=(0, 1)) / 10, found["body.beam.load.0.force"], rtol=1e-12
    )
    assert np.all(found["pins"][:, 2:] == 0.0) and np.any(found["pins"][0, :2] != 0.0)
    assert found.wall_events == () and found.unsettled == 0
    fallen = pliant.Simulation(scene)
    fallen.velocities = fallen.velocities - np.array([0.0, 0.5])
    first = fallen.gradient(tip, names, steps=20).wall_events[0]
    # The lower corner at the free end; 5 mm at half a metre a second take ten steps of a millisecond.
    assert isinstance(first, pliant.WallEvent) and first.has_come and first.wall == 0
    assert 9 <= first.step <= 11 and pliant.Simulation(scene).rest_positions[first.vertex, 1] == 0.0


def test_frequencies_have_derivatives_about_the_shape_at_rest() -> None:
    scene = beam(**{"world.gravity": [0, 0]})
    names = ["body.beam.elastic.young", "body.beam.rest", "body.beam.elastic.poisson_per_element"]
    found = pliant.Simulation(scene).frequency_gradient(names, 3)
    assert list(found) == names and found["body.beam.rest"].shape == (3, 20)
    assert found["body.beam.elastic.poisson_per_element"].shape == (3, 8) and list(found.alike) == [1, 1, 1]
    np.testing.assert_allclose(found.omega, pliant.modes(scene, 3)["omega"], rtol=1e-12)
    # omega^2 is in proportion to E, and to 1/L^2.
    np.testing.assert_allclose(found["body.beam.elastic.young"] * 1e5, found.omega**2, rtol=1e-10)
    rest = pliant.Simulation(scene).rest_positions.ravel()
    np.testing.assert_allclose(found["body.beam.rest"] @ rest, -2 * found.omega**2, rtol=1e-10)
    with pytest.raises(ValueError, match="under a force, that of uniform gravity"):
        pliant.Simulation(beam()).frequency_gradient(names)
    for name in ("velocity", "world.gravity", "forces"):
        with pytest.raises(KeyError, match=f"no derivative by `{name}`"):
            pliant.Simulation(scene).frequency_gradient([names[0], name])
    with pytest.raises(ValueError, match="100 modes were asked for"):
        pliant.Simulation(scene).frequency_gradient(names, 100)


def test_names_that_are_none_are_answered_with_those_that_are() -> None:
    simulation = pliant.Simulation(beam())
    with pytest.raises(KeyError, match=r"time\.step.*with respect to: position, velocity, forces, pins"):
        simulation.gradient(tip, ["time.step"], steps=1)


def test_one_name_needs_no_list() -> None:
    young = "body.beam.elastic.young"
    one, several = (pliant.Simulation(beam()).gradient(tip, of, steps=20) for of in (young, [young]))
    assert list(one) == [young] and one[young] == several[young]
    with pytest.raises(TypeError, match="a name, or a list of names, is wanted, got int"):
        pliant.Simulation(beam()).gradient(tip, 3, steps=1)  # type: ignore[arg-type]


def test_counts_below_zero_say_what_would_be_right() -> None:
    simulation = pliant.Simulation(beam())
    calls = [
        lambda: simulation.step(-3),
        lambda: simulation.gradient(tip, "position", steps=-3),
        lambda: simulation.jvp(steps=-3),
        lambda: pliant.modes(simulation, -3),
        lambda: simulation.frequency_gradient("body.beam.elastic.young", -3),
        lambda: pliant.rollout([beam()], -3),
    ]
    for call in calls:
        with pytest.raises(ValueError, match=r"-3"):
            call()
    assert simulation.steps == 0


def test_a_loss_that_fails_is_heard() -> None:
    def bad(frame: pliant.Frame) -> None:
        raise ArithmeticError("no such loss")

    simulation = pliant.Simulation(beam())
    with pytest.raises(ArithmeticError, match="no such loss"):
        simulation.gradient(bad, ["position"], steps=3)
    with pytest.raises(TypeError, match="a loss returns None"):
        simulation.gradient(lambda frame: 3.0, ["position"], steps=3)
    with pytest.raises(ValueError, match=r"must have shape \(10, 2\)"):
        simulation.gradient(lambda frame: (3.0, np.zeros(3)), ["position"], steps=3)
    with pytest.raises(ValueError, match="not finite at step"):
        simulation.gradient(lambda frame: (np.nan, None), ["position"], steps=3)
