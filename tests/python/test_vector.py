"""Many environments of one scene: the same bits as one alone, Gymnasium's rules, failures that are told."""

from __future__ import annotations

import multiprocessing
import sys
import warnings
from collections.abc import Callable
from typing import Any

import numpy as np
import pliant
import pytest
from conftest import beam

TIP = 9
MODES = ("next-step", "same-step", "disabled")
PUSH = pliant.ForceAction([TIP], axes="y", low=-2.0, high=2.0)
ACTIONS = np.random.default_rng(5).uniform(-1.0, 1.0, (6, 4, 1))


def tip(env: pliant.VectorEnvironment) -> np.ndarray:
    return env.positions[:, TIP, 1]


def thrown(rng: np.random.Generator, x: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    return x, v + 0.01 * rng.standard_normal(v.shape)


def pushed(force: float) -> np.ndarray:
    forces = np.zeros((10, 2))
    forces[TIP, 1] = force
    return forces


IMPLICIT = {"time.integrator": "newmark", "time.step": 5e-3}


@pytest.mark.parametrize("threads", [1, 2, 5])
@pytest.mark.parametrize("changes", [{}, IMPLICIT], ids=["explicit", "implicit"])
def test_each_has_the_bits_of_a_simulation_alone(threads: int, changes: dict[str, Any]) -> None:
    scene = beam(**changes)
    env = pliant.vector(scene, 4, action=PUSH, substeps=3, threads=threads)
    env.reset(seed=0)
    alone = [pliant.Simulation(scene) for _ in range(4)]
    for actions in ACTIONS:
        env.step(actions)
        for simulation, action in zip(alone, env.actions):
            simulation.external_forces = pushed(action[0])
            simulation.step(3)
        np.testing.assert_array_equal(env.positions, [each.positions for each in alone])
        np.testing.assert_array_equal(env.velocities, [each.velocities for each in alone])
    assert (env.positions[0] != env.positions[1]).any()
    np.testing.assert_array_equal(env.times, [each.time for each in alone])


def test_positions_are_one_array_that_cannot_be_written() -> None:
    env = pliant.vector(beam(), 4, action=PUSH)
    positions = env.positions
    assert positions.shape == (4, 10, 2) and positions.flags.c_contiguous
    env.step(np.zeros((4, 1)))
    before = positions.copy()
    env.step(np.zeros((4, 1)))
    assert env.positions is positions and (positions != before).any()
    np.testing.assert_array_equal(env.previous_positions, before)
    with pytest.raises(ValueError, match="read-only"):
        env.positions[0] = 0.0


def test_a_reset_by_mask_is_the_start_again_and_leaves_others_alone() -> None:
    env = pliant.vector(beam(), 4, action=PUSH, autoreset="disabled", start=thrown)
    env.reset(seed=7)
    first = env.velocities.copy()
    paths = [env.positions.copy() for actions in ACTIONS if env.step(actions)]
    before = env.positions.copy()
    mask = np.array([True, False, False, True])
    observations, info = env.reset(seed=7, options={"reset_mask": mask})
    np.testing.assert_array_equal(env.velocities[mask], first[mask])
    np.testing.assert_array_equal(env.positions[~mask], before[~mask])
    assert (
        (env.elapsed == [0, 6, 6, 0]).all()
        and (info["time"][mask] == 0.0).all()
        and (info["_time"] == mask).all()
    )
    for path, actions in zip(paths, ACTIONS):
        env.step(actions)
        np.testing.assert_array_equal(env.positions[mask], path[mask])
    for wrong, error in (
        ([True], TypeError),
        (np.zeros(4, bool), ValueError),
        (np.ones(3, bool), ValueError),
    ):
        with pytest.raises(error, match="reset_mask"):
            env.reset(options={"reset_mask": wrong})


def test_seeds_are_those_of_single_environments() -> None:
    many = pliant.vector(beam(), 3, action=PUSH, start=thrown)
    many.reset(seed=11)
    for i in range(3):
        one = pliant.vector(beam(), 1, action=PUSH, start=thrown)
        one.reset(seed=11 + i)
        np.testing.assert_array_equal(many.velocities[i], one.velocities[0])
    many.reset()
    assert (many.velocities[0] != one.velocities[0]).any()
    with pytest.raises(ValueError, match="3 environments, and 2 seeds"):
        many.reset(seed=[1, 2])


def single(number: int) -> Any:
    """The same environment, as one writes it for Gymnasium by hand."""
    gymnasium = pytest.importorskip("gymnasium")

    class Single(gymnasium.Env):  # type: ignore[misc, name-defined]
        observation_space = gymnasium.spaces.Box(-np.inf, np.inf, (40,), np.float32)
        action_space = gymnasium.spaces.Box(-2.0, 2.0, (1,), np.float32)

        def __init__(self) -> None:
            self.simulation = pliant.Simulation(beam())

        def observation(self) -> np.ndarray:
            simulation = self.simulation
            seen = np.concatenate([simulation.positions.ravel(), simulation.velocities.ravel()])
            return seen.astype(np.float32)

        def reset(self, *, seed: int | None = None, options: Any = None) -> tuple[np.ndarray, dict[str, Any]]:
            super().reset(seed=seed)
            self.simulation.reset()
            _, v = thrown(self.np_random, self.simulation.positions, self.simulation.velocities)
            self.simulation.velocities = v
            self.taken = 0
            return self.observation(), {"time": self.simulation.time}

        def step(self, action: np.ndarray) -> tuple[np.ndarray, float, bool, bool, dict[str, Any]]:
            self.simulation.external_forces = pushed(float(action[0]))
            self.simulation.step(3)
            self.taken += 1
            height = float(self.simulation.positions[TIP, 1])
            return (
                self.observation(),
                height,
                height < 0.0995,
                self.taken >= 4,
                {"time": self.simulation.time},
            )

    return Single()


@pytest.mark.parametrize("mode", MODES)
def test_it_is_what_gymnasium_makes_of_single_environments(mode: str) -> None:
    vector = pytest.importorskip("gymnasium").vector
    name = {"next-step": "NextStep", "same-step": "SameStep", "disabled": "Disabled"}[mode]
    theirs = vector.SyncVectorEnv([lambda i=i: single(i) for i in range(4)], autoreset_mode=name)
    ours = pliant.vector(
        beam(),
        4,
        action=PUSH,
        reward=tip,
        terminated=lambda env: tip(env) < 0.0995,
        start=thrown,
        substeps=3,
        max_steps=4,
        autoreset=mode,  # type: ignore[arg-type]
    )
    assert isinstance(ours, vector.VectorEnv) and isinstance(ours, pliant.VectorEnvironment)
    assert ours.metadata["autoreset_mode"] == theirs.metadata["autoreset_mode"]
    for name in ("single_action_space", "action_space", "single_observation_space", "observation_space"):
        assert getattr(ours, name) == getattr(theirs, name), name
    start, their_start = ours.reset(seed=3), theirs.reset(seed=3)
    np.testing.assert_array_equal(start[0], their_start[0])
    endings = []
    for t in range(12):
        actions = np.concatenate([ACTIONS, ACTIONS])[t].astype(np.float32)
        mine, other = ours.step(actions), theirs.step(actions)
        assert ours.observation_space.contains(mine[0])
        for one, two in zip(mine[:4], other[:4]):
            assert one.dtype == two.dtype
            np.testing.assert_array_equal(one, two)
        compare(mine[4], other[4])
        ended = mine[2] | mine[3]
        endings.append(int(ended.sum()))
        if mode == "disabled" and ended.any():
            with pytest.raises(
                ValueError, match=rf"environments \[{np.flatnonzero(ended)[0]}.* have ended: reset them"
            ):
                ours.step(actions)
            options = {"reset_mask": ended}
            np.testing.assert_array_equal(
                ours.reset(options=dict(options))[0], theirs.reset(options=dict(options))[0]
            )
    # Some end before others.
    assert any(0 < count < 4 for count in endings) and sum(endings) > 4
    ours.close()
    assert ours.closed


def compare(mine: dict[str, Any], theirs: dict[str, Any]) -> None:
    assert set(mine) == set(theirs)
    for key, value in mine.items():
        if isinstance(value, dict):
            # Of environments that have not ended nothing is said there.
            where = theirs["_final_info"]
            np.testing.assert_array_equal(value["time"][where], theirs[key]["time"][where])
        elif value.dtype == object:
            assert [other is None for other in theirs[key]] == [one is None for one in value]
            for one, other in zip(value, theirs[key]):
                np.testing.assert_array_equal(one, other)
        else:
            np.testing.assert_array_equal(value, theirs[key])


def test_wrappers_of_gymnasium_take_it() -> None:
    wrappers = pytest.importorskip("gymnasium").wrappers.vector
    env = pliant.vector(beam(), 2, action=PUSH, reward=tip, substeps=3, max_steps=3)
    wrapped = wrappers.RecordEpisodeStatistics(wrappers.NormalizeObservation(env))
    wrapped.reset(seed=1)
    for _ in range(3):
        _, rewards, _, truncated, info = wrapped.step(wrapped.action_space.sample())
    assert truncated.all() and (info["episode"]["l"] == 3).all() and np.isfinite(rewards).all()


def test_it_needs_no_gymnasium(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("gymnasium", "gymnasium.vector", "gymnasium.vector.utils", "gymnasium.spaces"):
        monkeypatch.setitem(sys.modules, name, None)
    env = pliant.vector(beam(), 2, action=PUSH, observe=tip, max_steps=2)
    assert type(env) is pliant.VectorEnvironment and env.metadata["autoreset_mode"] == "next-step"
    assert (env.action_space.shape, env.single_observation_space.shape) == ((2, 1), (1,))
    env.action_space.seed(4)
    action = env.action_space.sample()
    assert action in env.action_space and 3.0 * np.ones((2, 1)) not in env.action_space
    assert env.reset()[0].dtype == np.float32
    assert env.step(action)[3].sum() == 0 and env.step(action)[3].all()
    assert (env.step(action)[4]["time"] == 0.0).all()


def fragile() -> pliant.Scene:
    """A beam whose elements must not be turned inside out."""
    return beam(**{"body.0.elastic": {"neo-hookean": {"young": 1e5, "poisson": 0.3}}})


STRONG = pliant.ForceAction([TIP], axes="y", low=-1e5, high=1e5)


def test_a_failure_is_told_and_others_go_on() -> None:
    env = pliant.vector(fragile(), 3, action=STRONG, substeps=4)
    calm = pliant.vector(fragile(), 3, action=STRONG, substeps=4)
    actions = np.array([[0.0], [-1e5], [0.1]])
    with pytest.warns(
        RuntimeWarning,
        match=r"environment 1 has ended: step 3 \(t = 0.002 s\) failed: element 6 of `beam`",
    ):
        _, _, terminated, truncated, info = env.step(actions)
    assert (terminated == [False, True, False]).all() and not truncated.any()
    assert "s) failed" in info["failure"][1] and info["failure"][0] is None
    assert (info["failure_step"][1], info["failure_time"][1]) == (3, 2e-3)
    assert (info["_failure"] == terminated).all() and np.isfinite(env.positions).all()
    calm.step(np.where(actions < -1.0, 0.0, actions))
    others = [0, 2]
    np.testing.assert_array_equal(env.positions[others], calm.positions[others])
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        _, _, terminated, _, info = env.step(np.zeros((3, 1)))
    assert not terminated.any() and "failure" not in info and env.times[1] == 0.0
    raising = pliant.vector(fragile(), 3, action=STRONG, substeps=4, on_failure="raise")
    with pytest.raises(pliant.StepError, match="failed: element") as caught:
        raising.step(actions)
    assert caught.value.step == 3


def test_what_has_failed_takes_no_more_steps() -> None:
    calls: list[np.ndarray] = []

    def once(env: pliant.VectorEnvironment, numbers: np.ndarray) -> np.ndarray:
        forces = np.zeros(env.positions.shape)
        # Later steps could be taken.
        forces[:, TIP, 1] = numbers[:, 0] * (len(calls) % 4 == 0)
        calls.append(env.times)
        return forces

    env = pliant.vector(
        fragile(), 2, action=pliant.FunctionAction(1, once, low=-1e7, high=0.0, every=1), substeps=4
    )
    env.step([[0.0], [0.0]])
    env.reset()
    with pytest.warns(RuntimeWarning, match="environment 1 has ended: step 1 "):
        env.step([[0.0], [-1e7]])
    np.testing.assert_allclose(env.times, [4e-3, 0.0])
    # The force that it could not take is not there when it starts anew.
    env.step([[0.0], [0.0]])
    np.testing.assert_array_equal(env.positions[1], pliant.Simulation(fragile()).positions)


def test_pins_are_steered_as_by_hand() -> None:
    for by, turns in (("position", ""), ("position", "z"), ("velocity", "z")):
        action = pliant.PinAction(
            "beam/left",
            turns=turns,
            by=by,  # type: ignore[arg-type]
            low=-0.2,
            high=0.2,
        )
        env = pliant.vector(beam(), 2, action=action, substeps=10)
        alone = pliant.Simulation(beam())
        numbers = np.array([0.01, -0.02, 0.05])[: 2 + len(turns)]
        for t in range(3):
            now = numbers * (t + 1)
            env.step(np.array([np.zeros_like(now), now]))
            if by == "velocity":
                alone.move("beam/left", velocity=(now[:2], now[2]), over=0.01)
            else:
                angle = now[2] if turns else 0.0
                pose = np.eye(3)
                pose[:2, :2] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
                pose[:2, 2] = now[:2]
                alone.move("beam/left", pose, over=0.01)
            alone.step(10)
            np.testing.assert_allclose(env.positions[1], alone.positions, rtol=0.0, atol=1e-14)
        assert (env.positions[0] != env.positions[1]).any()


def test_values_of_the_scene_are_set_and_set_back() -> None:
    action = pliant.ValueAction("world.gravity.0", low=-5.0, high=5.0)
    env = pliant.vector(beam(), 2, action=action, substeps=5, autoreset="disabled")
    alone = pliant.Simulation(beam())
    alone.set({"world.gravity.0": 3.0})
    env.step([[0.0], [3.0]])
    alone.step(5)
    np.testing.assert_array_equal(env.positions[1], alone.positions)
    env.reset()
    assert env.simulation(1).gravity == [0.0, -9.8]
    env.step([[0.0], [0.0]])
    np.testing.assert_array_equal(env.positions[0], env.positions[1])
    with pytest.raises(KeyError, match="no value `world.gravity.7`"):
        pliant.vector(beam(), 1, action=pliant.ValueAction("world.gravity.7"))


def test_functions_of_forces_see_where_things_are() -> None:
    seen = []

    def spring(env: pliant.VectorEnvironment, numbers: np.ndarray) -> np.ndarray:
        seen.append(env.times[0])
        return -numbers[:, :, None] * (env.positions - env.rest_positions)

    env = pliant.vector(
        beam(), 2, action=pliant.FunctionAction(1, spring, low=0.0, high=50.0, every=2), substeps=4
    )
    env.step([[0.0], [50.0]])
    np.testing.assert_allclose(seen, [0.0, 0.002])
    alone = pliant.Simulation(beam())
    for _ in range(2):
        alone.external_forces = -50.0 * (alone.positions - alone.rest_positions)
        alone.step(2)
    np.testing.assert_array_equal(env.positions[1], alone.positions)
    same = env.simulation(1)
    np.testing.assert_array_equal(same.external_forces, alone.external_forces)
    same.step()
    alone.step()
    np.testing.assert_allclose(same.positions, alone.positions, rtol=0.0, atol=1e-15)


def test_it_observes_what_it_is_asked_for() -> None:
    scene = beam(probe=[{"name": "tip", "at": [0.4, 0.1]}])
    names = ["displacements", "probes:tip", "reactions:beam/left", "contacts", "time", "actions", tip]
    env = pliant.vector(scene, 2, action=PUSH, observe=names, substeps=20, dtype=np.float64)
    observations = env.step([[0.0], [1.0]])[0]
    assert observations.shape == env.observation_space.shape == (2, 20 + 4 + 3 + 2 + 1 + 1 + 1)
    alone = pliant.Simulation(scene)
    alone.external_forces = pushed(1.0)
    alone.step(20)
    force, moment = alone.reactions()["beam/left"]
    expected = np.concatenate(
        [
            (alone.positions - alone.rest_positions).ravel(),
            alone.positions[TIP],
            alone.velocities[TIP],
            force[:2],
            moment[2:],
            [0.0, 0.0, alone.time, 1.0],
            alone.positions[TIP, 1:],
        ]
    )
    np.testing.assert_allclose(observations[1], expected, rtol=1e-12, atol=1e-15)
    for wrong, error in (("velocity", ValueError), ("probes:none", KeyError), ("reactions:none", KeyError)):
        with pytest.raises(error, match="there is no"):
            pliant.vector(scene, 1, observe=wrong)


def test_forces_of_contact_are_equal_and_opposite() -> None:
    cells = {"mesh": {"grid": {"cells": [1, 1], "spacing": 0.1}}, "mass": {"density": 1000.0}}
    elastic = {"stable-neo-hookean": {"young": 1e5, "poisson": 0.3}}
    apart = {"elastic": elastic, "velocity": {"rigid": {"linear": [0.0, -0.5]}}}
    upper = {**cells, **apart, "name": "upper", "transform": {"translate": [0.01, 0.101]}}
    scene = pliant.Scene(
        dimension=2,
        time={"integrator": "implicit-euler", "step": 1e-3, "duration": 1.0},
        contact={"distance": 1e-3},
        body=[{**cells, "elastic": elastic, "name": "lower"}, upper],
    )
    env = pliant.vector(scene, 2, substeps=3)
    env.step(np.zeros((2, 0)))
    forces = env.contact_forces()
    assert forces.shape == (2, 2, 3) and (env.contact_forces("upper")[:, 1] > 1.0).all()
    np.testing.assert_allclose(forces[:, 0], -forces[:, 1], rtol=1e-12)


@pytest.mark.parametrize(
    ("make", "error", "message"),
    [
        (lambda: pliant.vector(beam(), 0), ValueError, "at least 1; got 0"),
        (
            lambda: pliant.vector(beam(), 1, autoreset="later"),  # type: ignore[arg-type]
            ValueError,
            "autoreset is one of next-step",
        ),
        (
            lambda: pliant.vector(beam(), 1, action=pliant.PinAction("beam/right")),
            KeyError,
            r"no pin 'beam/right'; there are \['beam/left'\]",
        ),
        (
            lambda: pliant.vector(beam(), 1, action=pliant.PinAction("beam/left", axes="xx")),
            ValueError,
            "letters of 'xy', each once; got 'xx'",
        ),
        (lambda: pliant.vector(beam(), 1, action=pliant.ForceAction([10])), ValueError, "vertices 0 to 9"),
        (
            lambda: pliant.vector(beam(), 1, action=pliant.ForceAction([1], low=2.0)),
            ValueError,
            "low below high",
        ),
        (
            lambda: pliant.vector(beam(), 1, action=PUSH).step(np.zeros((2, 1))),
            ValueError,
            r"shape \(1, 1\), got \(2, 1\)",
        ),
        (
            lambda: pliant.vector(beam(), 2, action=PUSH).step([[0.0], [np.nan]]),
            ValueError,
            "finite, got .*nan.* of environment 1",
        ),
        (
            lambda: pliant.vector(beam(), 2, reward=lambda env: env.positions).step(np.zeros((2, 0))),
            ValueError,
            r"rewards must have shape \(2,\)",
        ),
    ],
)
def test_mistakes_say_what_would_be_right(
    make: Callable[[], object], error: type[Exception], message: str
) -> None:
    with pytest.raises(error, match=message):
        make()


def test_steps_that_follow_the_error_are_refused() -> None:
    time = {"integrator": "dormand-prince5", "adaptive": {"tolerance": 1e-6}, "duration": 1.0}
    with pytest.raises(ValueError, match="step size of this scene is adaptive"):
        pliant.vector(beam(time=time), 1)


def stepped(env: pliant.VectorEnvironment) -> list[float]:
    return [float(env.step(actions)[0].sum()) for actions in ACTIONS]


@pytest.mark.skipif(
    not hasattr(sys, "getwindowsversion") and "fork" not in multiprocessing.get_all_start_methods(),
    reason="no fork here",
)
@pytest.mark.filterwarnings("ignore::DeprecationWarning", "ignore::RuntimeWarning")
def test_a_fork_goes_on_with_threads_of_its_own() -> None:
    env = pliant.vector(beam(), 4, action=PUSH, threads=2)
    env.step(ACTIONS[0])
    context = multiprocessing.get_context("fork")
    queue = context.Queue()
    child = context.Process(target=lambda: queue.put(stepped(env)))
    child.start()
    found = queue.get(timeout=60)
    child.join()
    assert found == stepped(env)
