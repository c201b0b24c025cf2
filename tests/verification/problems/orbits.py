"""Motions with closed forms or known to many digits: Kepler's ellipse of eccentricity 0.6 and 0.9 at t = 10
and 100, the figure of eight after a third of its period, Burrau's three bodies, which almost collide, at
t = 10 and 70. The integrators are Gauss-Radau of order 15 with its own adaptive steps, and velocity
Verlet, whose errors an independent implementation has, too.
"""

from math import sqrt

from case import Row

TITLE = "Orbits"
SOURCES = {
    "Kepler": "the equation of Kepler, solved to 30 digits (section A2 of the set-ups).",
    "A2": "an independent velocity Verlet of the same steps (section A2): its error.",
    "Chenciner": "A. Chenciner, R. Montgomery, Annals of Mathematics 152 (2000) 881-901; initial values "
    "of Simó: after a third of the period the bodies have exchanged positions. To 16 digits: "
    "section A3.",
    "Burrau": "C. Burrau 1913; V. Szebehely, C. F. Peters, Astronomical Journal 72 (1967) 876-883. To "
    "16 digits: heyoka at two tolerances (section A4).",
}
ADAPTIVE = {"integrator": "ias15", "adaptive": {}}
KEPLER = {
    (0.6, 10): (-1.5350235919098137, -0.28366840649978086),
    (0.6, 100): (-0.1041832044341806, -0.6947417155679506),
    (0.9, 10): (-1.8538537094055792, -0.13088540483992555),
    (0.9, 100): (-0.7506333330296452, -0.43100002757732134),
}
VERLET = {2000: 1.952e-3, 4000: 4.881e-4, 8000: 1.220e-4}
PERIOD = 6.325913982926211677589
BURRAU = {
    10: [(0.77848041013808549, 0.14139230029008617), (-2.0250924779781986, 0.097219384146058397)],
    70: [(6.9334635990118873, 20.261804305951714), (-2.0030060026059841, -6.8724634358245448)],
}


def rows(pliant, quick):
    for (e, end), (x, y) in KEPLER.items():
        ours = ellipse(pliant, e, ADAPTIVE | {"duration": float(end)})
        yield Row(f"Kepler, e = {e}, t = {end}, x", "", "Kepler", x, ours[0], "ias15, adaptive", 2e-11)
        yield Row(f"Kepler, e = {e}, t = {end}, y", "", "Kepler", y, ours[1], "ias15, adaptive", 2e-11)
    for steps, published in VERLET.items():
        x, y = ellipse(pliant, 0.6, {"integrator": "velocity-verlet", "step": 10 / steps, "duration": 10.0})
        error = sqrt((x - KEPLER[0.6, 10][0]) ** 2 + (y - KEPLER[0.6, 10][1]) ** 2)
        yield Row(
            "Kepler, e = 0.6, t = 10, error",
            "",
            "A2",
            published,
            error,
            f"velocity-verlet, {steps} steps",
            1e-3,
        )
    p, q = 0.3471168881189269382427769, 0.532724945388030229262028
    found = bodies(
        pliant,
        [(-1, 0), (1, 0), (0, 0)],
        [(p, q), (p, q), (-2 * p, -2 * q)],
        [1.0] * 3,
        ADAPTIVE | {"duration": PERIOD / 3},
    )
    start = [(-1.0, 0.0), (1.0, 0.0), (0.0, 0.0)]
    off = min(
        max(abs(a - b) for i in range(3) for a, b in zip(found[i], start[order[i]]))
        for order in [(1, 2, 0), (2, 0, 1)]
    )
    yield Row("figure of eight, T/3, off by", "", "Chenciner", 0.0, off, "ias15, adaptive", 1e-12)
    for end, places in BURRAU.items():
        found = bodies(
            pliant,
            [(1, 3), (-2, -1), (1, -1)],
            [(0, 0)] * 3,
            [3.0, 4.0, 5.0],
            ADAPTIVE | {"duration": float(end)},
        )
        for body, place in enumerate(places):
            for axis in range(2):
                name = f"three bodies, t = {end}, {'xy'[axis]} of the mass {3 + body}"
                yield Row(
                    name,
                    "",
                    "Burrau",
                    place[axis],
                    found[body][axis],
                    "ias15, adaptive",
                    1e-9 if end == 10 else 1e-5,
                )


def ellipse(pliant, e, time):
    """Place at the end: a light body about a heavy one, which hardly moves."""
    speed = sqrt((1 + e) / (1 - e))
    sun, planet = bodies(pliant, [(0, 0), (1 - e, 0)], [(0, 0), (0, speed)], [1.0, 1e-18], time)
    return planet[0] - sun[0], planet[1] - sun[1]


def bodies(pliant, places, speeds, masses, time):
    body = {
        "mesh": {"inline": {"points": places}},
        "mass": {"per_vertex": masses},
        "velocity": {"per_vertex": speeds},
    }
    probes = [{"name": f"b{i}", "vertex": i} for i in range(len(places))]
    world = {"nbody": {"constant": 1.0}}
    found = pliant.last({"dimension": 2, "time": time, "world": world, "body": [body], "probe": probes})
    return [(found[f"b{i}.x"], found[f"b{i}.y"]) for i in range(len(places))]
