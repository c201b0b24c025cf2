"""Orbits, beside REBOUND: Kepler's ellipse of eccentricity 0.9, and four planets around a sun.

The first has a closed form. For the second the answer is that of the Gauss-Radau schemes at their default
tolerance: REBOUND is measured against that of pliant, and pliant against that of REBOUND.
"""

from __future__ import annotations

from common import Case, measure, report  # isort: skip

from collections.abc import Callable

import numpy as np
import pliant
import rebound

Prepared = tuple[Callable[[], object], Callable[[], np.ndarray]]
System = tuple[float, np.ndarray, np.ndarray, np.ndarray]
"""Constant of gravity, masses, positions, velocities."""


def with_rebound(system: System, duration: float, name: str, steps: int = 0, **options: object) -> Case:
    """A case of REBOUND: ``steps`` equal steps, or as many as the scheme finds."""

    def prepare() -> Prepared:
        constant, masses, positions, velocities = system
        simulation = rebound.Simulation()
        simulation.G = constant
        for m, x, v in zip(masses, positions, velocities, strict=True):
            simulation.add(m=m, x=x[0], y=x[1], z=x[2], vx=v[0], vy=v[1], vz=v[2])
        simulation.integrator = name
        for key, value in options.items():
            setattr(simulation.integrator, key, value)
        simulation.dt = duration / steps if steps else 1e-3

        def work() -> None:
            if steps:
                simulation.steps(steps)
                simulation.synchronize()
            else:
                simulation.integrate(duration)

        return work, lambda: np.array([[p.x, p.y, p.z] for p in simulation.particles])

    return Case("REBOUND", label(name, steps, options), prepare)


def with_pliant(system: System, duration: float, name: str, steps: int = 0, **options: object) -> Case:
    """A case of pliant: ``steps`` equal steps, or as many as the scheme finds."""

    def prepare() -> Prepared:
        constant, masses, positions, velocities = system
        adaptive = {key: value for key, value in options.items() if key != "epsilon"}
        inner = {key: value for key, value in options.items() if key == "epsilon"}
        scene = pliant.Scene(
            dimension=3,
            time={
                "integrator": {name: inner} if inner else name,
                "duration": duration,
                **({"step": duration / steps} if steps else {"adaptive": adaptive}),
            },
            world={"nbody": {"constant": constant}},
            body=[
                {
                    "mesh": {"inline": {"points": positions}},
                    "mass": {"per_vertex": masses},
                    "velocity": {"per_vertex": velocities},
                }
            ],
            # Frames are landed on: none but the last.
            output={"rate": 1.0 / duration, "channels": ["state"]},
        )
        simulation = pliant.Simulation(scene)

        def work() -> None:
            if steps:
                simulation.step(steps)
            else:
                simulation.run(until=duration)

        return work, lambda: np.array(simulation.positions)

    return Case("pliant", label(name, steps, options), prepare)


def label(name: str, steps: int, options: dict[str, object]) -> str:
    more = [
        f"{key} {value:g}" if isinstance(value, float) else f"{key} {value}" for key, value in options.items()
    ]
    return ", ".join([name, *more, *([f"{steps} steps"] if steps else [])])


def kepler() -> None:
    """Ten periods of an ellipse of eccentricity 0.9 from the point nearest to the sun."""
    eccentricity, periods = 0.9, 10
    duration = periods * 2 * np.pi
    speed = np.sqrt((1 + eccentricity) / (1 - eccentricity))
    masses = np.array([0.999999, 1e-6])
    positions = np.array([[0.0, 0.0, 0.0], [1 - eccentricity, 0.0, 0.0]])
    velocities = np.array([[0.0, 0.0, 0.0], [0.0, speed, 0.0]])
    # The momentum is zero, so that nothing drifts.
    velocities -= masses @ velocities
    system = 1.0, masses, positions, velocities

    def error(case: Case) -> float:
        # After whole periods the planet is where it began, about the sun; the semi-major axis is 1.
        sun, planet = case.answer
        return float(np.linalg.norm(planet - sun - positions[1]))

    cases = []
    for steps in (4_000, 16_000, 64_000, 256_000):
        n = periods * steps // 10
        cases += [
            with_rebound(system, duration, "leapfrog", n),
            with_pliant(system, duration, "velocity-verlet", n),
            with_rebound(system, duration, "leapfrog", n, order=4),
            with_pliant(system, duration, "yoshida4", n),
        ]
    cases += [
        with_rebound(system, duration, "leapfrog", 16_000, order=8),
        with_rebound(system, duration, "leapfrog", 64_000, order=8),
        with_rebound(system, duration, "whfast", 1_000),
        *(with_rebound(system, duration, "ias15", epsilon=value) for value in (1e-3, 1e-5, 1e-7, 1e-9)),
        *(with_pliant(system, duration, "ias15", epsilon=value) for value in (1e-1, 1e-3, 1e-5, 1e-9)),
        *(
            with_rebound(system, duration, "bs", eps_rel=value, eps_abs=value)
            for value in (1e-6, 1e-9, 1e-12)
        ),
        *(with_pliant(system, duration, "dormand-prince5", tolerance=value) for value in (1e-6, 1e-9, 1e-12)),
    ]
    for case in cases:
        # Of two bodies it solves Kepler's equation itself.
        case.aside = case.settings.startswith("whfast")
    measure(cases, error)
    report("Kepler, eccentricity 0.9, 10 periods", cases, [1e-1, 1e-3, 1e-5, 1e-7, 1e-9, 1e-11])


def planets() -> None:
    """A sun and four planets, about those of the outer solar system, for 1000 years."""
    constant, duration = 4 * np.pi**2, 1000.0
    # Mass over the sun's, semi-major axis [au], eccentricity, inclination, where the near point is [rad].
    orbits = [
        (9.5e-4, 5.20, 0.048, 0.023, 0.3),
        (2.9e-4, 9.55, 0.054, 0.043, 1.6),
        (4.4e-5, 19.2, 0.047, 0.013, 3.0),
        (5.1e-5, 30.1, 0.009, 0.031, 4.9),
    ]
    masses, positions, velocities = [1.0], [np.zeros(3)], [np.zeros(3)]
    for m, a, e, inclination, angle in orbits:
        across = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
        x = across @ [a * (1 - e), 0.0]
        v = across @ [0.0, np.sqrt(constant * (1 + m) / a * (1 + e) / (1 - e))]
        tilt = np.array([[1, 0], [0, np.cos(inclination)], [0, np.sin(inclination)]])
        masses.append(m)
        positions.append(tilt @ x)
        velocities.append(tilt @ v)
    m, x, v = np.array(masses), np.array(positions), np.array(velocities)
    x, v = x - m @ x / m.sum(), v - m @ v / m.sum()
    system = constant, m, x, v
    exact = {}
    for case in (with_rebound(system, duration, "ias15"), with_pliant(system, duration, "ias15")):
        case.run()
        exact[case.program] = case.answer
    sizes = np.array([orbit[1] for orbit in orbits])

    def distance(one: np.ndarray, other: np.ndarray) -> float:
        apart = (one[1:] - one[0]) - (other[1:] - other[0])
        return float((np.linalg.norm(apart, axis=1) / sizes).max())

    apart = distance(exact["REBOUND"], exact["pliant"])
    print(f"\nPlanets: the two converged answers differ by {apart:.1e}.")

    def error(case: Case) -> float:
        return distance(case.answer, exact["pliant" if case.program == "REBOUND" else "REBOUND"])

    cases = []
    for steps in (2_000, 8_000, 32_000, 128_000):
        cases += [
            with_rebound(system, duration, "whfast", steps, safe_mode=0),
            with_rebound(system, duration, "leapfrog", steps),
            with_pliant(system, duration, "velocity-verlet", steps),
            with_rebound(system, duration, "leapfrog", steps, order=4),
            with_pliant(system, duration, "yoshida4", steps),
        ]
    cases += [
        *(
            with_rebound(system, duration, "whfast", n, safe_mode=0, corrector=17)
            for n in (2_000, 8_000, 32_000)
        ),
        *(
            with_rebound(system, duration, "saba", n, type="10_6_4", safe_mode=0)
            for n in (500, 1_000, 2_000, 4_000)
        ),
        *(with_rebound(system, duration, "leapfrog", n, order=8) for n in (2_000, 4_000, 8_000, 16_000)),
        *(with_rebound(system, duration, "ias15", epsilon=value) for value in (1e-3, 1e-5, 1e-9)),
        *(with_pliant(system, duration, "ias15", epsilon=value) for value in (1e-1, 1e-3, 1e-5, 1e-9)),
        *(with_rebound(system, duration, "bs", eps_rel=value, eps_abs=value) for value in (1e-8, 1e-11)),
        *(with_pliant(system, duration, "dormand-prince5", tolerance=value) for value in (1e-8, 1e-11)),
    ]
    measure(cases, error)
    report("A sun and four planets, 1000 years", cases, [1e-1, 1e-3, 1e-5, 1e-7, 1e-9, 1e-10])


if __name__ == "__main__":
    print(f"\n## Beside REBOUND {rebound.__version__}")
    kepler()
    planets()
