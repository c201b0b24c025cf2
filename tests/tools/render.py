"""Draws frames of a recording side by side into a PNG, to look at the motion without a viewer.

Usage: render.py RECORDING.mcap OUT.png [FRAMES]
Needs mcap, numpy and matplotlib. 3D scenes are seen from the front and a little from above, z up.
"""

import sys

import matplotlib
import numpy as np
from mcap.reader import make_reader

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402
from matplotlib.collections import LineCollection, PolyCollection  # noqa: E402


def project(points: np.ndarray, flat: bool) -> tuple[np.ndarray, np.ndarray]:
    """Picture coordinates and depth (away from the eye) of points (n, 3)."""
    if flat:
        return points[:, :2], np.zeros(len(points))
    turn, tilt = np.radians(25.0), np.radians(15.0)
    x, y, z = points.T
    right = np.cos(turn) * x + np.sin(turn) * y
    away = -np.sin(turn) * x + np.cos(turn) * y
    up = np.cos(tilt) * z + np.sin(tilt) * away
    return np.column_stack([right, up]), np.cos(tilt) * away - np.sin(tilt) * z


def load(path: str):
    with open(path, "rb") as file:
        reader = make_reader(file)
        metadata = {}
        for record in reader.iter_metadata():
            metadata.update(record.metadata)
        triangles, edges = [], []
        for attachment in reader.iter_attachments():
            if attachment.name.endswith((".surface.u32", ".tri.u32")):
                triangles.append(np.frombuffer(attachment.data, "<u4").reshape(-1, 3))
            if attachment.name.endswith(".edge.u32"):
                edges.append(np.frombuffer(attachment.data, "<u4").reshape(-1, 2))
        states = [(m.log_time * 1e-9, m.data) for _, _, m in reader.iter_messages(topics=["/state"])]
    count = int(metadata["vertex_count"])
    frames = [(t, np.frombuffer(memoryview(d)[-count * 48 :], "<f8").reshape(count, 6)[:, :3]) for t, d in states]
    return frames, triangles, edges, metadata["dimension"] == "2"


def draw(axes, points, triangles, edges, flat):
    picture, depth = project(points, flat)
    for cells in triangles:
        order = np.argsort(-depth[cells].mean(axis=1))
        corners = points[cells[order]]
        normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        length = np.linalg.norm(normal, axis=1, keepdims=True)
        light = np.abs(normal / np.where(length > 0, length, 1) @ np.array([0.3, -0.7, 0.65]))
        shade = np.full_like(light, 0.75) if flat else 0.35 + 0.6 * light
        # In the plane, triangles that are inside out are red.
        inverted = flat & (normal[:, 2] < 0)
        colours = np.column_stack([np.where(inverted, 0.9, 0.5 * shade), np.where(inverted, 0.3, 0.7 * shade), np.where(inverted, 0.2, shade)])
        axes.add_collection(PolyCollection(picture[cells[order]], facecolors=colours, edgecolors=(0, 0, 0, 0.25), linewidths=0.2))
    for cells in edges:
        axes.add_collection(LineCollection(picture[cells], colors="k", linewidths=0.4))
    if not triangles and not edges:
        axes.plot(*picture.T, "k.", markersize=2.0 if len(picture) > 50 else 8.0)


def main(path: str, out: str, count: int = 8) -> None:
    frames, triangles, edges, flat = load(path)
    chosen = [frames[i] for i in np.unique(np.linspace(0, len(frames) - 1, count).astype(int))]
    everything = np.vstack([project(points, flat)[0] for _, points in chosen])
    # A few vertices far away must not shrink the rest to a dot.
    low, high = np.percentile(everything, [0.2, 99.8], axis=0)
    margin = 0.08 * max(high - low)
    columns = min(4, len(chosen))
    rows = -(-len(chosen) // columns)
    figure, all_axes = plt.subplots(rows, columns, figsize=(4 * columns, 3.4 * rows), squeeze=False)
    for axes in all_axes.flat:
        axes.set_axis_off()
    for axes, (time, points) in zip(all_axes.flat, chosen):
        draw(axes, points, triangles, edges, flat)
        axes.set(xlim=(low[0] - margin, high[0] + margin), ylim=(low[1] - margin, high[1] + margin), aspect="equal", title=f"t = {time:.3f} s")
    figure.tight_layout()
    figure.savefig(out, dpi=80)


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2], *(int(a) for a in sys.argv[3:4]))
