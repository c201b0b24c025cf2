"""Checks pictures of `pliant render` and arrays of `pliant export` by readers that are not ours.

Usage: read_pictures.py FILE ...
Of each .png and .gif: it opens, all frames decode and have the size of the picture, frames of
animations last and differ, and corners are transparent where the file says `transparent`. Of each .npz: its
arrays have the shapes that belong together. Needs Pillow and numpy.
"""

import sys
from pathlib import Path

import numpy as np
from PIL import Image, ImageSequence


def check_picture(path: Path) -> str:
    with Image.open(path) as picture:
        frames, times = [], []
        for frame in ImageSequence.Iterator(picture):
            frames.append(np.asarray(frame.convert("RGBA")))
            times.append(frame.info.get("duration", 0))
        size = picture.size
    assert all(frame.shape == (size[1], size[0], 4) for frame in frames), path
    colours = [len(np.unique(frame.reshape(-1, 4), axis=0)) for frame in frames]
    assert min(colours) > 2, f"{path}: a frame is empty"
    if len(frames) > 1:
        assert all(time >= 20 for time in times), f"{path}: {times}"
        assert all((a != b).any() for a, b in zip(frames, frames[1:])), f"{path}: two frames are equal"
    # Walls of a plane scene may cover a corner.
    alpha = {frame[..., 3].min() for frame in frames}
    assert alpha == ({0} if "transparent" in path.name else {255}), f"{path}: {alpha}"
    return f"{len(frames)} frames of {size[0]} x {size[1]}"


def check_arrays(path: Path) -> str:
    with np.load(path) as arrays:
        x, v, times, bodies = (arrays[name] for name in ("positions", "velocities", "times", "bodies"))
        assert x.shape == v.shape and x.shape[0] == len(times), path
        assert np.isfinite(x).all() and (np.diff(times) > 0).all(), path
        assert bodies[:, 1].sum() == x.shape[1], path
        for name in arrays.files:
            if arrays[name].dtype == np.uint32 and name != "bodies":
                assert arrays[name].max() < x.shape[1], f"{path}: {name}"
        return f"{x.shape[0]} frames of {x.shape[1]} vertices"


def main(files: list[str]) -> None:
    for name in files:
        path = Path(name)
        print(f"{path.name}: {check_arrays(path) if path.suffix == '.npz' else check_picture(path)}")


if __name__ == "__main__":
    main(sys.argv[1:])
