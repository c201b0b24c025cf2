"""Seven stars of masses 1 to 7 in the plane, with close encounters; G = 1 and no softening. The test set
gives the state at t = 3 to 16 digits, computed in quadruple precision; a second source has 25 digits and
agrees with them.
"""

from case import Row

TITLE = "Bari test set: Pleiades"
SOURCES = {
    "Bari": "F. Mazzia, C. Magherini, Test Set for Initial Value Problem Solvers, University of "
    "Bari, problem PLEI. Second source: kayejlli/RKAdaptiveMethods, by a method of order 14 "
    "in quadruple precision.",
}
PLACES = [(3, 3), (3, -3), (-1, 2), (-3, 0), (2, 0), (-2, -4), (2, 4)]
SPEEDS = [(0, 0), (0, 0), (0, 0), (0, -1.25), (0, 1), (1.75, 0), (-1.5, 0)]
END_X = [0.3706139143970502, 3.237284092057233, -3.222559032418324, 0.6597091455775310]
END_X += [0.3425581707156584, 1.562172101400631, -0.7003092922212495]
END_Y = [-3.943437585517392, -3.271380973972550, 5.225081843456543, -2.590612434977470]
END_Y += [1.198213693392275, -0.2429682344935824, 1.091449240428980]


def rows(pliant, quick):
    # The scheme of the field to rounding, one with a tolerance, one of fixed step.
    for name, time, within in [
        ("ias15, adaptive", {"integrator": "ias15", "adaptive": {}}, 1e-11),
        ("dormand-prince5, 1e-9", {"integrator": "dormand-prince5", "adaptive": {"tolerance": 1e-9}}, 1e-5),
        ("yoshida4, 10 us", {"integrator": "yoshida4", "step": 1e-5}, 1e-6),
    ]:
        found = pliant.last(scene(time | {"duration": 3.0}))
        for star in range(7):
            if name == "ias15, adaptive":
                yield Row(f"x{star + 1}", "", "Bari", END_X[star], found[f"s{star}.x"], name, within)
                yield Row(f"y{star + 1}", "", "Bari", END_Y[star], found[f"s{star}.y"], name, within)
        off = max(
            abs(found[f"s{i}.{a}"] - end[i]) for i in range(7) for a, end in (("x", END_X), ("y", END_Y))
        )
        yield Row("largest error of the 14", "", "Bari", 0.0, off, name, within)


def scene(time):
    body = {
        "mesh": {"inline": {"points": PLACES}},
        "mass": {"per_vertex": [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0]},
        "velocity": {"per_vertex": SPEEDS},
    }
    probes = [{"name": f"s{star}", "vertex": star} for star in range(7)]
    return {
        "dimension": 2,
        "time": time,
        "world": {"nbody": {"constant": 1.0}},
        "body": [body],
        "probe": probes,
    }
