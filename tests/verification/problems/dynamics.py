"""Motions and vibrations of continua with closed forms or limits known to many digits.

- A mass on a spring of 10 kN/m, released at 60 degrees: its position after 10 s.
- Ten masses of 0.1 kg on springs of 100 N/m between two walls, the first displaced by 1.
- A block on an incline, with friction coefficient 0.3 at 28.6 degrees, and 0.5 at 34.4: the sliding
  distance after 1 s. Implicit Euler is ahead by half a step.
- A cantilever of 10 m by 1 m in plane strain: its natural frequencies.
- A string under tension, stretched by 2 %: its frequencies about the equilibrium. Lumped masses lower
  them by (j pi / n)^2 / 24.
- A column under a fraction of Euler's load: the square of its lowest frequency over that without load.
"""

from math import cos, pi, sin, sqrt

from case import STATIC, Row

TITLE = "Closed forms: motions, friction, vibrations"
SOURCES = {
    "A6": "heyoka at two tolerances (section A6 of the set-ups).",
    "A5": "sum over the modes, `w_j = 2 sqrt(k/m) sin(j pi / 22)` (section A5).",
    "Coulomb": "g (sin a - mu cos a) t^2 / 2.",
    "C6": "independent code, elements of fourth order, graded (section C6).",
    "string": "f_j = j / (2 L) sqrt(T / m'), m' by the length as it is.",
    "beam": "E I w'''' + P w'' = m' w^2 w, clamped and free, by its determinant (scipy): the ratio is "
    "1 - P/P_cr to 6 %. A solid of this height buckles 0.2 % earlier.",
}


def rows(pliant, quick):
    time = {"integrator": "dormand-prince5", "adaptive": {"tolerance": 1e-11}, "duration": 10.0}
    found = pliant.last(pendulum(time))
    for axis, published in (("x", -0.62832052323265), ("y", -0.77969972957809)):
        name = f"spring pendulum, {axis} at 10 s"
        yield Row(name, "m", "A6", published, found[f"m.{axis}"], "dormand-prince5, 1e-11", 1e-10)

    found = pliant.last(chain({"integrator": "yoshida4", "step": 2e-5, "duration": 1.0}))
    for mass, published in ((1, -0.4762809155423357), (5, -0.1685172395752511), (10, -0.1149062770022994)):
        yield Row(
            f"chain, mass {mass} at 1 s",
            "m",
            "A5",
            published,
            found[f"m{mass}.ux"],
            "yoshida4, 20 us",
            1e-9,
        )

    for friction, angle in ((0.3, 0.5), (0.5, 0.6)):
        published = 9.81 * (sin(angle) - friction * cos(angle)) / 2
        ours = pliant.last(incline(friction, angle, 0.005))["p.ux"]
        yield Row(
            f"incline, mu = {friction}", "m", "Coulomb", published, ours, "implicit-euler, 5 ms", 0.0075
        )

    beam = {
        "mesh": {"grid": {"cells": [80, 8], "size": [10.0, 1.0]}},
        "elastic": {"linear": {"young": 1e6, "poisson": 0.3}},
        "order": 2,
        "mass": {"density": 1000.0},
        "pin": [{"half_space": {"normal": [1, 0], "offset": 0}}],
    }
    found = pliant.frequencies({"dimension": 2, "time": STATIC, "body": [beam]}, 4)
    for mode, published in enumerate((0.05321494, 0.3183142, 0.8305891, 0.8355264)):
        yield Row(
            f"cantilever, mode {mode + 1}",
            "Hz",
            "C6",
            published,
            found[mode],
            "6-node triangles, 80 x 8 boxes",
            5e-4,
        )

    length, tension = 1.02, 1e3 * 0.02
    found = pliant.frequencies(string(100), 3, equilibrium=True)
    for mode, ours in enumerate(found, 1):
        published = mode / (2 * length) * sqrt(tension * length / 0.01)
        yield Row(f"string, mode {mode}", "Hz", "string", published, ours, "100 springs", 5e-4)

    free = pliant.frequencies(column(1e-9), 1, equilibrium=True)[0]
    for part, published, within in (
        (-1.0, 1.8752098, 5e-4),
        (0.5, 0.51964137, 3e-3),
        (0.9, 0.1075883, 0.025),
    ):
        ours = (pliant.frequencies(column(part), 1, equilibrium=True)[0] / free) ** 2
        name = f"column under {part} of Euler's load"
        yield Row(name, "", "beam", published, ours, "6-node triangles, 40 x 2 boxes", within)


def pendulum(time):
    body = {
        "mesh": {"inline": {"points": [[0, 0], [sin(pi / 3), -cos(pi / 3)]], "edges": [[0, 1]]}},
        "springs": {"stiffness": 1e4, "rest_length": 1.0},
        "mass": {"per_vertex": 1.0},
        "pin": [{"vertices": [0]}],
    }
    world = {"gravity": [0, -9.81]}
    probe = [{"name": "m", "vertex": 1}]
    return {"dimension": 2, "time": time, "world": world, "body": [body], "probe": probe}


def chain(time):
    body = {
        "mesh": {"strand": {"segments": 11, "start": [0, 0], "end": [110, 0]}},
        "springs": {"stiffness": 100.0},
        "mass": {"per_vertex": 0.1},
        "pin": [{"vertices": [0, 11]}],
        "position": {"displacement": [[1.0 if vertex == 1 else 0.0, 0.0] for vertex in range(12)]},
    }
    probes = [{"name": f"m{vertex}", "vertex": vertex} for vertex in (1, 5, 10)]
    return {"dimension": 2, "time": time, "body": [body], "probe": probes}


def incline(friction, angle, step):
    body = {
        "name": "block",
        "mesh": {"grid": {"cells": [2, 1], "size": [0.2, 0.1], "origin": [0, 1e-4]}},
        "elastic": {"neo-hookean": {"young": 1e7, "poisson": 0.3}},
        "mass": {"density": 1000.0},
    }
    return {
        "dimension": 2,
        "contact": {"friction": friction, "threshold_speed": 1e-3, "distance": 1e-4},
        "time": {"integrator": "implicit-euler", "step": step, "duration": 1.0},
        "world": {"gravity": [9.81 * sin(angle), -9.81 * cos(angle)]},
        "body": [body],
        "obstacle": [{"name": "plane", "shape": {"half_space": {"normal": [0, 1], "offset": 0}}}],
        "probe": [{"name": "p", "vertex": 0}],
    }


def string(segments):
    body = {
        "mesh": {"strand": {"segments": segments, "start": [0, 0], "end": [1, 0]}},
        "springs": {"stiffness": 1e3 * segments},
        "mass": {"density": 0.01},
        "pin": [
            {"vertices": [0]},
            {"vertices": [segments], "motion": {"displacement": ["0.02 * min(t, 1)", "0"]}},
        ],
    }
    return {"dimension": 2, "time": STATIC, "body": [body]}


def column(part):
    young, height, length = 1e6, 0.1, 2.0
    critical = pi**2 * young * height**3 / 12 / (4 * length**2)
    body = {
        "mesh": {"grid": {"cells": [40, 2], "size": [length, height]}},
        "elastic": {"stvk": {"young": young, "poisson": 0.0}},
        "order": 2,
        "mass": {"density": 1000.0},
        "pin": [{"half_space": {"normal": [1, 0], "offset": 0}}],
        "load": [
            {
                "half_space": {"normal": [-1, 0], "offset": -length},
                "traction": [-part * critical / height, 0],
            }
        ],
    }
    return {"dimension": 2, "time": STATIC, "body": [body]}
