"""The stepper: states, steps, parameters, measurements."""

from __future__ import annotations

import copy
import gc
import itertools
import pickle
import sys
import threading
import tracemalloc
import weakref
from typing import Any

import numpy as np
import pliant
import pytest
from conftest import SCENES, beam


def test_arrays_have_the_shape_and_order_of_numpy(simulation: pliant.Simulation) -> None:
    for array in (simulation.positions, simulation.velocities, simulation.rest_positions):
        assert array.shape == (10, 2) and array.dtype == np.float64 and array.flags.c_contiguous
    assert (simulation.dimension, simulation.vertex_count, simulation.masses.shape) == (2, 10, (10,))


def test_copies_are_copies(simulation: pliant.Simulation) -> None:
    before = simulation.positions
    kept = before.copy()
    simulation.step(10)
    np.testing.assert_array_equal(before, kept)
    # What is written into a copy would be lost in silence.
    for copy in (simulation.positions, simulation.velocities):
        with pytest.raises(ValueError, match="read-only"):
            copy[0] = 7.0
    changed = simulation.positions.copy()
    changed[0] += 0.5
    simulation.positions = changed
    np.testing.assert_array_equal(simulation.positions, changed)


# Lecture 3: a step of one's own.
def test_a_step_written_in_numpy_has_the_bits_of_the_simulation() -> None:
    damping = {"body.0.damping": {"strain_rate": {"shear": 5.0}}}
    simulation = pliant.Simulation(beam(**damping))
    x, v, h = simulation.positions, simulation.velocities, simulation.step_size
    for _ in range(50):
        v = v + h * simulation.accelerations(x, v)
        x = x + h * v
        simulation.step()
        np.testing.assert_array_equal(simulation.positions, x)
        np.testing.assert_array_equal(simulation.velocities, v)


def test_forces_are_masses_times_accelerations_and_slopes_of_energies(simulation: pliant.Simulation) -> None:
    simulation.step(20)
    x = simulation.positions
    forces, terms = simulation.forces(), simulation.forces(by_term=True)
    np.testing.assert_array_equal(forces, sum(terms.values()))
    np.testing.assert_array_equal(forces, simulation.forces(x, simulation.velocities))
    accelerations = simulation.accelerations()
    pinned = (accelerations == 0.0).all(axis=1)
    assert list(np.flatnonzero(pinned)) == [0, 1]
    inertia = simulation.masses[:, None] * accelerations
    np.testing.assert_allclose(forces[~pinned], inertia[~pinned], rtol=1e-12, atol=1e-12)
    energies = simulation.energy(by_term=True)
    assert list(energies) == list(terms) and "elements of `beam`" in terms
    total = simulation.energy(x)
    assert total["elastic"] == energies["elements of `beam`"] == simulation.energy()["elastic"]
    assert "balance.loads" not in total
    # Central differences of second order, of an energy whose third derivative is moderate.
    d = 1e-6
    for vertex, axis in [(9, 0), (4, 1)]:
        high, low = x.copy(), x.copy()
        high[vertex, axis] += d
        low[vertex, axis] -= d
        slope = (simulation.energy(high)["total"] - simulation.energy(low)["total"]) / (2 * d)
        np.testing.assert_allclose(forces[vertex, axis], -slope, rtol=1e-5, atol=1e-5)
    np.testing.assert_array_equal(simulation.positions, x)


def test_a_force_that_is_not_finite_says_where(simulation: pliant.Simulation) -> None:
    barrier = pliant.Simulation(beam(**{"body.0.elastic": {"neo-hookean": {"young": 1e5, "poisson": 0.3}}}))
    with pytest.raises(ValueError, match=r"not finite there: element \d+ of `beam` has J = "):
        barrier.forces(barrier.positions * [-1.0, 1.0])
    with pytest.raises(ValueError, match=r"positions must have shape \(10, 2\)"):
        simulation.forces(np.zeros((9, 2)))


def test_numbers_that_are_not_real_are_refused(simulation: pliant.Simulation) -> None:
    for wrong, kind in [(1j * np.ones((10, 2)), "complex"), (np.ones((10, 2), dtype=bool), "booleans")]:
        with pytest.raises(TypeError, match=f"velocities must be real numbers, got {kind}"):
            simulation.velocities = wrong
    # Whole numbers and single precision are numbers.
    simulation.velocities = np.zeros((10, 2), dtype=np.int64)
    simulation.velocities = np.zeros((10, 2), dtype=np.float32)


def test_nothing_is_copied_before_its_shape_is_right(simulation: pliant.Simulation) -> None:
    broadcast = np.broadcast_to(np.zeros(2), (10**8, 2))
    tracemalloc.start()
    with pytest.raises(ValueError, match=r"positions must have shape \(10, 2\), got \(100000000, 2\)"):
        simulation.positions = broadcast
    _, most = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert most < 1_000_000


def test_arguments_that_are_none_name_the_right_one(simulation: pliant.Simulation) -> None:
    with pytest.raises(TypeError, match=r"no argument `youngs`: did you mean `young`\?"):
        simulation.set_material("beam", youngs=1e5)  # type: ignore[call-arg]
    with pytest.raises(TypeError, match=r"got `str`; `Scene.from_toml\(path\)` reads a file"):
        pliant.Scene("scene.toml")  # type: ignore[call-arg]


def test_a_path_is_no_scene_and_says_what_reads_one() -> None:
    with pytest.raises(TypeError, match=r"of a `Scene`, got `str`; `Scene.from_toml\(path\)` reads one"):
        pliant.Simulation("scenes/cantilever_fem_2d.toml")  # type: ignore[arg-type]


def test_views_follow_and_outlive_the_simulation() -> None:
    # Not the fixture, which pytest would keep.
    simulation = pliant.Simulation(beam())
    x, v = simulation.positions_view, simulation.velocities_view
    assert x is simulation.positions_view and np.shares_memory(x, simulation.positions_view)
    assert not x.flags.writeable
    with pytest.raises(ValueError, match="read-only"):
        x[0] = 0.0
    for change in (
        lambda: simulation.step(),
        lambda: simulation.step(7),
        lambda: simulation.run(0.05),
        lambda: setattr(simulation, "positions", simulation.positions + 0.001),
        lambda: setattr(simulation, "state", pliant.Simulation(beam()).state),
        lambda: simulation.step(3),
        lambda: simulation.reset(),
        lambda: simulation.step(3),
    ):
        change()
        np.testing.assert_array_equal(x, simulation.positions)
        np.testing.assert_array_equal(v, simulation.velocities)
        assert not x.flags.writeable
    last, gone = simulation.positions, weakref.ref(simulation)
    del simulation, change
    gc.collect()
    assert gone() is None
    # The next owner of its memory writes something else there.
    others = [pliant.Simulation(beam(**{"body.0.pin": []})) for _ in range(20)]
    [other.step(10) for other in others]
    np.testing.assert_array_equal(x, last)


def test_anything_array_like_is_taken(simulation: pliant.Simulation) -> None:
    x = simulation.positions.copy()
    for given in (x.astype(np.float32), np.asfortranarray(x), x.tolist(), x[::-1][::-1]):
        simulation.positions = given
        np.testing.assert_allclose(simulation.positions, x, atol=1e-7)
    simulation.velocities = np.ones((10, 2), dtype=int)
    np.testing.assert_array_equal(simulation.velocities[2:], 1.0)
    np.testing.assert_array_equal(simulation.velocities[:2], 0.0)  # pinned


@pytest.mark.parametrize("name", ["positions", "velocities", "external_forces"])
def test_wrong_arrays_say_what_would_be_right(simulation: pliant.Simulation, name: str) -> None:
    what = name.replace("_", " ")
    with pytest.raises(ValueError, match=rf"{what} must have shape \(10, 2\), got \(3,\)"):
        setattr(simulation, name, [1.0, 2.0, 3.0])
    bad = np.zeros((10, 2))
    bad[4, 1] = np.nan
    with pytest.raises(ValueError, match=f"{what} must be finite, got NaN at vertex 4"):
        setattr(simulation, name, bad)
    with pytest.raises((ValueError, TypeError)):
        setattr(simulation, name, "positions")


# lecture 3: the stepper as a black box.
def test_advance_is_pure(simulation: pliant.Simulation) -> None:
    simulation.step(5)
    state, x0, v0 = simulation.state, simulation.positions, simulation.velocities
    x1, v1 = simulation.advance(x0, v0)
    assert simulation.state == state
    simulation.step()
    np.testing.assert_array_equal(x1, simulation.positions)
    np.testing.assert_array_equal(v1, simulation.velocities)
    np.testing.assert_array_equal(x0, state.positions)


def test_states_go_back_and_forth(simulation: pliant.Simulation) -> None:
    simulation.step(10)
    state = pickle.loads(pickle.dumps(simulation.state))
    assert state == simulation.state and (state.step, state.time) == (10, 10 * 1e-3)
    simulation.step(10)
    end = simulation.state
    simulation.state = state
    simulation.step(10)
    assert simulation.state == end
    other = pliant.Simulation(beam(**{"body.0.mesh.grid.cells": [3, 1]}))
    with pytest.raises(ValueError, match="state of another scene"):
        other.state = state


# lecture 21: reset.
def test_reset_is_the_beginning(simulation: pliant.Simulation) -> None:
    start = simulation.state
    simulation.step(10)
    end = simulation.state
    simulation.reset()
    assert simulation.state == start and simulation.time == 0.0
    simulation.step(10)
    assert simulation.state == end


@pytest.mark.parametrize(
    "duplicate",
    [
        lambda simulation: simulation.clone(),
        copy.deepcopy,
        lambda simulation: pickle.loads(pickle.dumps(simulation)),
    ],
)
def test_duplicates_go_on_alone_with_all_that_was_changed(
    duplicate: Any, simulation: pliant.Simulation
) -> None:
    simulation.step(10)
    simulation.set_material("beam", young=5e4)
    simulation.external_forces = np.full((10, 2), 0.5)
    simulation.pin([9], name="hand")
    simulation.release("beam/left")
    simulation.step(10)
    other = duplicate(simulation)
    assert other.state == simulation.state and other.pins == simulation.pins == ["hand"]
    simulation.step(10)
    assert other.steps == 20
    other.step(10)
    assert other.state == simulation.state
    other.reset()
    assert other.steps == 0 and simulation.steps == 30


# lecture 21: E and nu change while it runs.
def test_a_stiffer_beam_hangs_less(simulation: pliant.Simulation) -> None:
    soft = simulation.clone()
    simulation.set_material(0, young="400 kPa", poisson=0.1)
    for each in (simulation, soft):
        each.set({"world.ether_drag": 20.0})
        each.step(2000)
    sag, soft_sag = ((each.rest_positions - each.positions)[9, 1] for each in (simulation, soft))
    # Small displacements: in proportion to 1/E, but for what nu does and what large rotations do.
    assert 0.2 < sag / soft_sag < 0.3
    assert 'young = "400 kPa"' in simulation.scene.text


def test_changes_that_cannot_be_change_nothing(simulation: pliant.Simulation) -> None:
    simulation.step(3)
    state, scene = simulation.state, simulation.scene
    with pytest.raises(pliant.SceneError, match="allows at most"):
        simulation.set_material("beam", young=1e12)
    with pytest.raises(pliant.SceneError, match="poisson"):
        simulation.set_material("beam", poisson=0.7)
    with pytest.raises(ValueError, match="body.0.velocity says how a simulation starts"):
        simulation.set({"body.0.velocity": {"rigid": {"linear": [1.0, 0.0]}}})
    with pytest.raises(KeyError, match="no body rope"):
        simulation.set_material("rope", young=1.0)
    assert simulation.state == state and simulation.scene == scene
    simulation.step()


def test_gravity_can_be_turned_off(simulation: pliant.Simulation) -> None:
    assert simulation.gravity == [0.0, -9.8]
    simulation.release("beam/left")
    simulation.step(20)
    before = simulation.momentum()
    simulation.gravity = (0.0, 0.0)
    assert simulation.gravity == [0.0, 0.0]
    simulation.step(20)
    np.testing.assert_allclose(simulation.momentum(), before, atol=1e-12)


# lecture 21: a vertex is grabbed and dragged.
def test_a_changed_motion_goes_on_from_where_the_pin_is() -> None:
    still, h = pliant.Simulation(beam()), 1e-3
    still.step(500)
    before = still.positions[:2]
    motion = {"displacement": ["0.3 * t", "0.1 * sin(t)"]}
    still.set({"body.0.pin.0.motion": motion})
    np.testing.assert_allclose(still.positions[:2], before, rtol=0.0, atol=1e-15)
    t0 = still.time
    still.step(10)
    expected = before + [0.3 * (still.time - t0), 0.1 * (np.sin(still.time) - np.sin(t0))]
    np.testing.assert_allclose(still.positions[:2], expected, atol=1e-13)
    other = pickle.loads(pickle.dumps(still))
    for each in (still, other):
        each.step(10)
    np.testing.assert_allclose(other.positions, still.positions, rtol=0.0, atol=1e-12)
    still.reset()
    start = still.positions[:2]
    still.step()
    np.testing.assert_allclose(still.positions[:2], start + [0.3 * h, 0.1 * np.sin(h)], atol=1e-13)


def test_pins_hold_and_are_dragged(simulation: pliant.Simulation) -> None:
    assert simulation.pins == ["beam/left"]
    name = simulation.pin(np.arange(10) == 9, axes="y")
    x = simulation.positions.copy()
    x[9, 1] += 0.01
    simulation.positions = x
    simulation.step(20)
    assert simulation.positions[9, 1] == x[9, 1] and simulation.positions[9, 0] != x[9, 0]
    assert np.linalg.norm(simulation.reactions()[name][0]) > 0.0
    simulation.release(name)
    simulation.step(5)
    assert simulation.positions[9, 1] != x[9, 1]
    with pytest.raises(KeyError, match="no pin"):
        simulation.release(name)
    for wrong in (10, -1, [0.5], []):
        with pytest.raises(ValueError, match="vert"):
            simulation.pin(wrong)
    with pytest.raises(ValueError, match="axes"):
        simulation.pin([1], axes="w")
    with pytest.raises(ValueError, match="mask"):
        simulation.pin([True, False])


# lecture 1: M x'' = f.
def test_forces_by_array_and_by_function_are_the_same() -> None:
    by_array, by_function, falling = (pliant.Simulation(beam(**{"body.0.pin": []})) for _ in range(3))
    for each in (by_array, by_function):
        each.gravity = [0.0, 0.0]
    weight = falling.masses[:, None] * [0.0, -9.8]
    times = []

    def force(time: float, positions: np.ndarray) -> np.ndarray:
        times.append(time)
        assert positions.shape == (10, 2)
        return weight

    by_array.external_forces = weight
    by_function.external_forces = force
    for each in (by_array, by_function, falling):
        each.step(50)
    np.testing.assert_allclose(by_array.positions, falling.positions, atol=1e-14)
    np.testing.assert_array_equal(by_array.positions, by_function.positions)
    np.testing.assert_allclose(times[:3], [0.0, 1e-3, 2e-3])
    energy = by_array.energy()
    assert by_function.external_forces is force
    by_array.external_forces = None
    assert by_array.external_forces is None
    assert abs(energy["kinetic"] - 0.5 * by_array.masses.sum() * (9.8 * 0.05) ** 2) < 1e-9


def test_what_a_function_raises_comes_through(simulation: pliant.Simulation) -> None:
    def late(time: float, positions: np.ndarray) -> np.ndarray:
        if time > 0.0055:
            raise LookupError("no force")
        return np.zeros_like(positions)

    simulation.external_forces = late
    with pytest.raises(LookupError, match="no force") as caught:
        simulation.step(100)
    assert isinstance(caught.value.__cause__, pliant.StepError)
    assert simulation.steps == 5
    simulation.external_forces = lambda time, positions: positions[:2]
    with pytest.raises(ValueError, match=r"function must have shape \(10, 2\), got \(2, 2\)"):
        simulation.step()
    simulation.external_forces = lambda time, positions: simulation.step()
    with pytest.raises(RuntimeError, match="in the middle of a step"):
        simulation.step()


def test_a_step_that_cannot_be_taken_says_where(simulation: pliant.Simulation) -> None:
    scene = beam(**{"body.0.elastic": {"neo-hookean": {"young": 1e5, "poisson": 0.3}}})
    simulation = pliant.Simulation(scene)
    simulation.step(2)
    # A corner of element 7 pushed through its opposite side.
    x = simulation.positions.copy()
    x[9] = [0.2, 0.05]
    simulation.positions = x
    with pytest.raises(pliant.StepError, match="element .* of `beam` has J = ") as caught:
        simulation.step(10)
    error = caught.value
    assert isinstance(error, RuntimeError)
    assert (error.step, error.time, error.body, error.step_size) == (3, 2e-3, "beam", 1e-3)
    assert error.element is not None and error.J is not None and error.J <= 0.0
    again = pickle.loads(pickle.dumps(error))
    assert vars(again) == vars(error) and str(again) == str(error)
    np.testing.assert_array_equal(simulation.positions, x)


def test_measurements_agree_with_one_another(simulation: pliant.Simulation) -> None:
    simulation.step(60)
    energy, m, v = simulation.energy(), simulation.masses, simulation.velocities
    assert abs(energy["kinetic"] - 0.5 * (m @ (v**2).sum(axis=1))) < 1e-12
    assert abs(energy["total"] - energy["kinetic"] - energy["elastic"] - energy["gravitational"]) < 1e-12
    np.testing.assert_allclose(simulation.momentum(), m @ v, atol=1e-12)
    x = simulation.positions.copy()
    spin = (m * (x[:, 0] * v[:, 1] - x[:, 1] * v[:, 0])).sum()
    np.testing.assert_allclose(simulation.angular_momentum(), [0.0, 0.0, spin], atol=1e-12)
    # lecture 18: F = D_s D_m^-1.
    cells, rest = simulation.bodies[0]["triangles"], simulation.rest_positions

    def edges(y: np.ndarray) -> np.ndarray:
        return np.stack([y[cells[:, 1]] - y[cells[:, 0]], y[cells[:, 2]] - y[cells[:, 0]]], axis=-1)

    f = simulation.deformation_gradient()
    np.testing.assert_allclose(f, edges(x) @ np.linalg.inv(edges(rest)), atol=1e-12)
    cauchy, piola = simulation.stress(), simulation.stress("first-piola")
    assert cauchy.shape == (8, 3, 3)
    np.testing.assert_allclose(
        cauchy[:, :2, :2],
        piola[:, :2, :2] @ f.transpose(0, 2, 1) / np.linalg.det(f)[:, None, None],
        rtol=1e-9,
        atol=1e-6,
    )
    deviator = cauchy - np.trace(cauchy, axis1=1, axis2=2)[:, None, None] / 3 * np.eye(3)
    np.testing.assert_allclose(
        simulation.stress("von-mises"), np.sqrt(1.5 * (deviator**2).sum(axis=(1, 2))), rtol=1e-9
    )
    np.testing.assert_allclose(simulation.measure("jacobian")[:, 0], np.linalg.det(f), rtol=1e-12)
    name: Any = "mises"
    for wrong in (lambda: simulation.stress(name), lambda: simulation.measure(name)):
        with pytest.raises(ValueError, match="there are"):
            wrong()


# lecture 2: M u'' + K u = 0.
def test_stresses_at_nodes_are_those_of_the_elements_recovered(simulation: pliant.Simulation) -> None:
    x = simulation.rest_positions
    gradient = np.array([[1.2, 0.1], [-0.05, 0.9]])
    simulation.positions = x @ gradient.T
    of_elements = simulation.stress()
    for recovery, rows in (("patch", len(x)), ("average", len(x)), ("element", 3 * len(of_elements))):
        vertices, stress = simulation.nodal_stress(recovery)
        assert (vertices.shape, stress.shape) == ((rows,), (rows, 3, 3))
        np.testing.assert_allclose(stress, np.broadcast_to(of_elements[0], stress.shape), atol=1e-6)
    _, principal = simulation.nodal_stress(kind="principal")
    expected = np.linalg.eigvalsh(of_elements[0])[::-1]
    np.testing.assert_allclose(principal, np.broadcast_to(expected, principal.shape), atol=1e-6)
    # A mean of elements, of the tensors, not of von Mises stresses.
    simulation.positions = x + 0.05 * np.sin(20.0 * x[:, ::-1])
    vertices, of_each = simulation.nodal_stress("element")
    _, mean = simulation.nodal_stress("average")
    _, von_mises = simulation.nodal_stress("average", "von-mises")
    for vertex in range(len(x)):
        np.testing.assert_allclose(of_each[vertices == vertex].mean(axis=0), mean[vertex], rtol=1e-9)
    deviator = mean - np.trace(mean, axis1=1, axis2=2)[:, None, None] / 3.0 * np.eye(3)
    np.testing.assert_allclose(von_mises, np.sqrt(1.5 * (deviator**2).sum(axis=(1, 2))), rtol=1e-9)
    with pytest.raises(ValueError, match="average"):
        simulation.nodal_stress("mean")
    with pytest.raises(ValueError, match="principal"):
        simulation.nodal_stress(kind="tresca")


def test_matrices_are_those_of_the_linearised_motion(simulation: pliant.Simulation) -> None:
    pytest.importorskip("scipy")
    stiffness, mass = simulation.stiffness(), simulation.mass()
    assert stiffness.shape == mass.shape == (20, 20) and stiffness.has_sorted_indices
    k, m = stiffness.toarray(), mass.toarray()
    np.testing.assert_allclose(k, k.T, atol=1e-8)
    # Nothing resists translation.
    np.testing.assert_allclose(k @ np.tile([1.0, 2.0], 10), 0.0, atol=1e-7)
    np.testing.assert_array_equal(np.diag(m), np.repeat(simulation.masses, 2))
    free = np.arange(4, 20)
    omega2 = np.linalg.eigvals(np.linalg.solve(m[np.ix_(free, free)], k[np.ix_(free, free)])).real.max()
    # Symplectic Euler is stable up to h omega = 2.
    assert abs(simulation.critical_step() * np.sqrt(omega2) / 2 - 1) < 1e-3
    assert simulation.damping().nnz == 0 or abs(simulation.damping()).max() == 0
    galaxy = pliant.Simulation(pliant.Scene.from_toml(SCENES / "kepler.toml"))
    with pytest.raises(ValueError, match="matrix is full"):
        galaxy.stiffness()


def is_stepping(simulation: pliant.Simulation) -> bool:
    try:
        simulation.time
    except RuntimeError as error:
        assert "in the middle of a step" in str(error)
        return True
    return False


def test_two_threads_step_two_simulations_at_once() -> None:
    both = [pliant.Simulation(beam()) for _ in range(2)]
    threads = [threading.Thread(target=each.step, args=(60_000,)) for each in both]
    [thread.start() for thread in threads]
    at_once = 0
    while any(thread.is_alive() for thread in threads):
        at_once += all([is_stepping(each) for each in both])
        threads[0].join(0.001)
    # Who held the lock of the interpreter for a step would have kept the other out, and us.
    assert at_once > 0
    alone = pliant.Simulation(beam())
    alone.step(60_000)
    assert all(each.state == alone.state for each in both)


def test_python_goes_on_while_a_simulation_steps(simulation: pliant.Simulation) -> None:
    counts = []

    def go() -> None:
        simulation.step(400_000)
        counts.append(None)

    thread = threading.Thread(target=go)
    thread.start()
    ticks = 0
    refused = 0
    while not counts:
        ticks += 1
        refused += is_stepping(simulation)
        thread.join(0.001)
    # A holder of the interpreter's lock would have let no other thread count.
    assert ticks > 3 and refused > 0 and simulation.steps == 400_000


def test_memory_does_not_grow() -> None:
    def resident() -> int:
        with open("/proc/self/statm") as file:
            return int(file.read().split()[1]) * 4096

    simulation = pliant.Simulation(beam())
    view = simulation.positions_view

    def work(steps: int, simulations: int) -> None:
        for _ in range(steps):
            simulation.step()
            simulation.positions, simulation.velocities  # noqa: B018
        for _ in range(simulations):
            pliant.Simulation(beam()).positions_view  # noqa: B018
        gc.collect()

    def growth() -> int:
        before = resident()
        work(10_000, 1_000)
        return resident() - before

    work(2_000, 200)
    # A leak of a state of 320 bytes a step would be 6 MB, of a simulation of some 20 kB 20 MB, and that every
    # time. The allocator takes some for itself now and then, with threads of other tests about.
    assert min(growth() for _ in range(3)) < 4_000_000
    assert view.shape == (10, 2)


# The overhead of a step is measured by benches/overhead.py; what costs most of it, objects of Python, can be
# counted.
@pytest.mark.parametrize(("is_shuffled", "count"), [(False, 1000), (True, 5)])
def test_a_step_makes_no_objects_of_python(is_shuffled: bool, count: int) -> None:
    simulation = pliant.Simulation(shuffled() if is_shuffled else beam())
    views = simulation.positions_view, simulation.velocities_view

    def peak(steps: int) -> int:
        # Nothing in the loop makes an object either.
        steps_to_take = itertools.repeat(None, steps)
        step = simulation.step
        step()
        tracemalloc.reset_peak()
        before = tracemalloc.get_traced_memory()[0]
        for _ in steps_to_take:
            step()
        return tracemalloc.get_traced_memory()[1] - before

    tracemalloc.start()
    try:
        # As many bytes as no step at all.
        assert peak(count) == peak(0)
    finally:
        tracemalloc.stop()
    np.testing.assert_array_equal(views[0], simulation.positions)
    np.testing.assert_array_equal(views[1], simulation.velocities)


def shuffled() -> pliant.Scene:
    """A sheet large enough to be numbered anew, whose own numbers are at random."""
    side = 100
    x, y = np.meshgrid(np.arange(side), np.arange(side))
    order = np.random.default_rng(1).permutation(side * side)
    points = np.empty((side * side, 2))
    points[order] = np.stack([x.ravel(), y.ravel()], axis=1) * 0.1
    corner = np.arange(side * side).reshape(side, side)[:-1, :-1].ravel()
    cells = [[corner, corner + 1, corner + side + 1], [corner, corner + side + 1, corner + side]]
    triangles = order[np.concatenate([np.stack(cell, axis=1) for cell in cells])]
    scene = beam(**{"body.0.pin": []}).to_toml()
    return pliant.Scene.from_toml(scene).with_changes(
        {"body.0.mesh": {"inline": {"points": points, "triangles": triangles}}, "time.step": 1e-4}
    )


# time: adaptive steps, and steps in parts, and what they cost.
def test_work_counts_what_was_tried_again() -> None:
    scene = pliant.Scene.from_toml(SCENES / "pressed_block_2d.toml")
    simulation = pliant.Simulation(scene)
    simulation.run()
    retried = simulation.work["retried"]
    assert retried["steps"] > 0 and retried["parts"] >= 2 * retried["steps"] and retried["halvings"] >= 1
    adaptive = (
        beam(**{"time.integrator": "bogacki-shampine3"})
        .to_toml()
        .replace("step = 0.001", "adaptive = { tolerance = 1e-4 }")
    )
    scene = pliant.Scene.from_toml(adaptive)
    assert scene.step_size is None
    simulation = pliant.Simulation(scene)
    first = simulation.step_size
    simulation.run()
    assert simulation.work["rejected_steps"] >= 0 and simulation.step_size != first
    assert simulation.time == 0.1 and "retried" not in simulation.work


def test_nothing_is_kept_alive() -> None:
    simulation = pliant.Simulation(beam())
    force = lambda time, positions: np.zeros_like(positions)  # noqa: E731
    before = sys.getrefcount(force)
    simulation.external_forces = force
    assert sys.getrefcount(force) > before
    simulation.step(3)
    simulation.external_forces = None
    assert sys.getrefcount(force) == before
    view = simulation.positions_view
    array = simulation.positions
    assert sys.getrefcount(array) == 2
    gone = weakref.ref(simulation)
    del simulation
    gc.collect()
    assert gone() is None
    assert sys.getrefcount(view) == 2


CLAMPED = """
dimension = 2
time = { integrator = "rk4", step = 1e-4, duration = 1.0 }
[[body]]
name = "arm"
mesh = { grid = { cells = [2, 1], spacing = 0.1 } }
elastic = { corotated = { young = 1e4, poisson = 0.3 } }
mass = { density = 1000.0 }
pin = [{ name = "clamp", vertices = [0, 3] }]
"""


def test_a_pin_is_steered():
    simulation = pliant.Simulation(pliant.Scene.from_toml(CLAMPED))
    start = simulation.positions[[0, 3]]
    assert simulation.pins == ["arm/clamp"]
    simulation.move("arm/clamp", [0.0, 0.02], over=0.01)
    simulation.step(50)
    # Half of the way: the cubic polynomial is symmetric.
    np.testing.assert_allclose(simulation.positions[[0, 3]] - start, [[0.0, 0.01]] * 2, atol=1e-13)
    again = pickle.loads(pickle.dumps(simulation))
    simulation.step(100)
    again.step(100)
    assert (again.positions == simulation.positions).all()
    np.testing.assert_allclose(simulation.positions[[0, 3]] - start, [[0.0, 0.02]] * 2, atol=1e-13)
    # A quarter of a turn about the middle of what is held, and on with 3 rad/s and 1 m/s.
    pose = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.02], [0.0, 0.0, 1.0]])
    simulation.move("arm/clamp", pose, ([1.0, 0.0], 3.0), over=0.02)
    simulation.step(200)
    middle = start.mean(axis=0)
    arm = (start - middle) @ pose[:2, :2].T
    np.testing.assert_allclose(simulation.positions[[0, 3]], middle + [0.0, 0.02] + arm, atol=1e-12)
    velocity = np.array([1.0, 0.0]) + 3.0 * np.column_stack([-arm[:, 1], arm[:, 0]])
    np.testing.assert_allclose(simulation.velocities[[0, 3]], velocity, atol=1e-10)
    # A change of the scene does not end it.
    simulation.set_material("arm", young=2e4)
    simulation.step(100)
    np.testing.assert_allclose(simulation.positions[[0, 3]].mean(axis=0), middle + [0.01, 0.02], atol=1e-12)


def test_what_cannot_be_steered_is_said():
    simulation = pliant.Simulation(pliant.Scene.from_toml(CLAMPED))
    with pytest.raises(KeyError, match="there is no pin `grip` that holds"):
        simulation.move("grip", [0.0, 0.1])
    with pytest.raises(ValueError, match="displacement of a pin"):
        simulation.move("arm/clamp", [0.0, 0.1, 0.2])
    with pytest.raises(ValueError, match="a rotation and a displacement"):
        simulation.move("arm/clamp", 2.0 * np.eye(3))
    with pytest.raises(ValueError, match="positive time"):
        simulation.move("arm/clamp", [0.0, 0.1], over=0.0)
