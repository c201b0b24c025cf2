"""One cube under tension along x, with free sides: the force per reference section (the first
Piola-Kirchhoff stress) and the lateral stretch at a stretch of 1.5 and 0.7, E = 1 MPa, nu = 0.3. The
closed form has one root, the lateral stretch, to 13 digits.
"""

from case import STATIC, Row

TITLE = "Closed forms: materials under tension"
SOURCES = {
    "B2": "psi of each model, by mpmath with 50 digits (section B2 of the set-ups).",
}
# Lateral stretch and stress at 1.5, then at 0.7.
PUBLISHED = {
    "stvk": (0.7905694150421, 937500.0, 1.073778375644, -178500.0),
    "corotated": (0.85, 500000.0, 1.09, -300000.0),
    "fixed-corotated": (0.8693320997697, 442868.6154255, 1.093536258819, -343170.6489377),
    "neo-hookean": (0.8801745918067, 378280.1763943, 1.107934732848, -405230.4243143),
    "neo-hookean-j": (0.871868463921, 382011.6363128, 1.095870939271, -390622.5909549),
    "stable-neo-hookean": (0.8692269873604, 383190.8831909, 1.087967586552, -381139.2688944),
    "stable-neo-hookean-log": (0.8670861235458, 404445.5200627, 1.085299261326, -372899.8471869),
    "isochoric-neo-hookean": (0.8843382454227, 338397.1662366, 1.104472315293, -445549.3666651),
    "hencky": (0.8854674932956, 270310.0720721, 1.112937018101, -509535.6341982),
}


def rows(pliant, quick):
    for model, values in PUBLISHED.items():
        for i, stretch in enumerate((1.5, 0.7)):
            body = {
                "mesh": {"grid": {"cells": [1, 1, 1], "size": [1.0, 1.0, 1.0]}},
                "elastic": {model: {"young": 1e6, "poisson": 0.3}},
                "mass": {"density": 1000.0},
                "pin": [
                    {"half_space": {"normal": [1, 0, 0], "offset": 0}, "axes": ["x"]},
                    {"half_space": {"normal": [0, 1, 0], "offset": 0}, "axes": ["y"]},
                    {"half_space": {"normal": [0, 0, 1], "offset": 0}, "axes": ["z"]},
                    {
                        "half_space": {"normal": [-1, 0, 0], "offset": -1},
                        "axes": ["x"],
                        "motion": {"velocity": [stretch - 1, 0, 0]},
                    },
                ],
            }
            time = STATIC | {"step": 0.25}
            probe = [{"name": "p", "at": [1.0, 1.0, 1.0]}]
            found = pliant.last({"dimension": 3, "time": time, "body": [body], "probe": probe})
            # P = sigma A / A0.
            stress, sides = found["p.sxx"] * found["p.y"] * found["p.z"], found["p.y"]
            yield Row(f"{model}, sides at {stretch}", "", "B2", values[2 * i], sides, "6 tetrahedra", 1e-8)
            yield Row(
                f"{model}, stress at {stretch}", "Pa", "B2", values[2 * i + 1], stress, "6 tetrahedra", 1e-8
            )
