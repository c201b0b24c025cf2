"""Writes scenes/meshes/half_disk.msh: the lower half of a disk of radius 1 m about (0, 1).

Its lowest point is the origin, with triangles of 5 mm around that point and coarser ones away from it.
"""

import math
from pathlib import Path

FINE, CELLS, GROWTH, COARSE = 0.005, 20, 1.35, 0.2


def graded(end: float) -> list[float]:
    """Places from 0 to `end`: fine at 0, then growing."""
    places, size = [0.0], FINE
    while places[-1] < end:
        places.append(places[-1] + size)
        if len(places) > CELLS:
            size = min(COARSE, size * GROWTH)
    return places[: CELLS + 1] + [
        FINE * CELLS + (p - FINE * CELLS) * (end - FINE * CELLS) / (places[-1] - FINE * CELLS)
        for p in places[CELLS + 1 :]
    ]


angles = graded(math.pi / 2)
angles = [-a for a in reversed(angles[1:])] + angles
radii = [1.0 - depth for depth in graded(1.0)[:-1]]
points = [(r * math.sin(a), 1.0 - r * math.cos(a)) for r in radii for a in angles] + [(0.0, 1.0)]
width, triangles = len(angles), []
for i in range(len(radii) - 1):
    for j in range(width - 1):
        a, b, c, d = i * width + j, i * width + j + 1, (i + 1) * width + j + 1, (i + 1) * width + j
        # Diagonals mirrored about the axis.
        triangles += [(a, b, c), (a, c, d)] if j < width // 2 else [(a, b, d), (b, c, d)]
first = (len(radii) - 1) * width
triangles += [(first + j, first + j + 1, len(points) - 1) for j in range(width - 1)]
# What lies on the middle plane lies there exactly.
points = [(x, 1.0 if abs(y - 1.0) < 1e-12 else y) for x, y in points]
lines = ["$MeshFormat", "2.2 0 8", "$EndMeshFormat", "$Nodes", str(len(points))]
lines += [f"{i} {x:.12g} {y:.12g} 0" for i, (x, y) in enumerate(points, 1)]
lines += ["$EndNodes", "$Elements", str(len(triangles))]
lines += [f"{i} 2 2 0 1 {a + 1} {b + 1} {c + 1}" for i, (a, b, c) in enumerate(triangles, 1)]
target = Path(__file__).parents[2] / "scenes" / "meshes" / "half_disk.msh"
target.write_text("\n".join(lines + ["$EndElements", ""]))
