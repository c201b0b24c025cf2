"""Pages and pictures of recordings, in notebooks and files."""

from __future__ import annotations

import struct
import tempfile
import time
import urllib.error
import urllib.request
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pliant
import pytest
from conftest import beam

MARKUP = "\"'><script>alert(1)</script>&amp;</iframe>"


class Tags(HTMLParser):
    """Tags of a piece of HTML with their attributes, as a browser reads them."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.found: list[tuple[str, dict[str, str | None]]] = []
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.found.append((tag, dict(attrs)))


def size(png: bytes) -> tuple[int, int]:
    assert png.startswith(b"\x89PNG\r\n\x1a\n") and png.endswith(b"IEND\xaeB`\x82")
    width, height = struct.unpack(">II", png[16:24])
    return width, height


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> pliant.Trajectory:
    path = tmp_path_factory.mktemp("recorded") / "beam.mcap"
    pliant.Simulation(beam(**{"output.rate": "200 1/s", "title": MARKUP})).run(record=path)
    return pliant.load(path)


def test_a_notebook_is_given_the_page_and_a_picture(recorded: pliant.Trajectory) -> None:
    view = recorded.view(height=300)
    shown = view._repr_mimebundle_()
    assert set(shown) == {"text/plain", "text/html", "image/png"}
    assert recorded._repr_mimebundle_()["image/png"] == shown["image/png"]
    [(tag, attributes)] = Tags(shown["text/html"]).found
    # One frame without an origin of its own, whose page is the whole text, whatever a title holds.
    assert tag == "iframe" and attributes["sandbox"] == "allow-scripts"
    assert attributes["srcdoc"] == view.html and "height: 300px" in (attributes["style"] or "")
    assert view.frames == view.frame_count == len(recorded) and view.left_out == []
    assert MARKUP not in view.html and "<script>alert" not in view.html
    width, height = size(view.png)
    assert (width, height > 2 * 300) == (2 * 400, True), "three frames in two rows"


def test_what_does_not_fit_is_left_out(recorded: pliant.Trajectory) -> None:
    whole, less = recorded.view(), recorded.view(max_bytes=500)
    assert 2 <= less.frames < len(recorded) == less.frame_count
    assert len(less.html) < len(whole.html)
    for name in ("max_bytes", "height"):
        with pytest.raises(ValueError, match=f"`{name}` must be 1 or more, got 0"):
            recorded.view(**{name: 0})


def test_pages_and_pictures_are_saved(recorded: pliant.Trajectory, tmp_path: Path) -> None:
    view = recorded.view()
    page, picture = view.save(tmp_path / "run.html"), view.save(tmp_path / "run.PNG")
    assert page.read_text(encoding="utf-8") == view.html and picture.read_bytes() == view.png
    with pytest.raises(FileExistsError):
        view.save(page)
    assert view.save(page, overwrite=True) == page
    with pytest.raises(ValueError, match=r"run.gif ends in neither .html nor .png"):
        view.save(tmp_path / "run.gif")


def test_a_state_is_shown_and_left_as_it_is(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    one, other = pliant.Simulation(beam()), pliant.Simulation(beam())
    for simulation in (one, other):
        simulation.step(10)
    view = one.view()
    assert (view.frames, view.frame_count) == (1, 1) and size(view.png) == (400, 300)
    assert one.steps == 10 and one.time == other.time
    for simulation in (one, other):
        simulation.step(10)
    np.testing.assert_array_equal(one.positions, other.positions)
    assert one.energy() == other.energy()
    assert list(tmp_path.iterdir()) == [], "the recording is removed"
    with pytest.raises(ValueError, match="`height` must be 1 or more, got -1"):
        one.view(height=-1)


def test_a_recording_that_is_gone_is_an_error(recorded: pliant.Trajectory, tmp_path: Path) -> None:
    path = tmp_path / "short.mcap"
    path.write_bytes(Path(recorded.path).read_bytes())
    trajectory = pliant.load(path)
    path.unlink()
    with pytest.raises(OSError, match="short.mcap"):
        trajectory.view()


@pytest.mark.parametrize(
    ("dimension", "element", "kind"), [(2, "quadrilateral", "quad"), (3, "hexahedron", "hexahedron")]
)
def test_cells_that_are_no_simplices_are_read(
    tmp_path: Path, dimension: int, element: str, kind: str
) -> None:
    mesh = {"grid": {"cells": [2, 3, 1][:dimension], "spacing": 0.1, "element": element}}
    scene = pliant.Scene(
        dimension=dimension,
        time={"integrator": "symplectic-euler", "step": 1e-4, "duration": 1e-3},
        body=[
            {
                "name": "block",
                "mesh": mesh,
                "mass": {"density": 1e3},
                "elastic": {"corotated": {"young": 1e4, "poisson": 0.3}},
            }
        ],
        output={"rate": 1e3, "channels": ["state", "mesh"]},
    )
    pliant.Simulation(scene).run(record=tmp_path / "block.mcap")
    trajectory = pliant.load(tmp_path / "block.mcap")
    suffix, width = {"quad": ("quad", 4), "hexahedron": ("hex", 8)}[kind]
    assert trajectory.topology["block"][suffix].shape == (6, width)
    meshio = pytest.importorskip("meshio")
    mesh = trajectory.to_meshio()
    assert isinstance(mesh, meshio.Mesh) and [block.type for block in mesh.cells] == [kind]
    pytest.importorskip("pyvista")
    grid = trajectory.to_pyvista()
    # Corners in the order that VTK has: a cell with two exchanged has another size.
    sizes = grid.compute_cell_sizes()
    np.testing.assert_allclose(
        sizes.cell_data["Area" if dimension == 2 else "Volume"], 0.1**dimension, rtol=1e-6
    )


def test_rerun_is_given_meshes_once_and_vertices_by_frame(
    recorded: pliant.Trajectory, tmp_path: Path
) -> None:
    rerun = pytest.importorskip("rerun")
    logged: list[tuple[str, bool, object]] = []
    times: list[float] = []

    class Stream(rerun.RecordingStream):  # type: ignore[misc,name-defined]
        def log(self, path: str, entity: object, *extra: object, static: bool = False) -> None:
            logged.append((path, static, entity))
            super().log(path, entity, *extra, static=static)

        def set_time(self, timeline: str, **at: float) -> None:
            times.append(at["duration"])
            super().set_time(timeline, **at)

    stream = Stream("pliant")
    stream.save(tmp_path / "beam.rrd")
    pliant.to_rerun(recorded, stream)
    stream.flush()
    assert (tmp_path / "beam.rrd").stat().st_size > len(recorded) * 12 * recorded.vertex_count
    np.testing.assert_array_equal(times, recorded.times)
    assert [path for path, static, _ in logged if static] == ["bodies", "bodies/beam"]
    moved = [entity for path, static, entity in logged if not static and path == "bodies/beam"]
    assert len(moved) == len(recorded)
    last = np.array(moved[-1].vertex_positions.as_arrow_array().to_pylist())  # type: ignore[attr-defined]
    np.testing.assert_allclose(last[:, :2], recorded.positions[-1], rtol=1e-6)
    assert not last[:, 2].any()
    with pytest.raises(ValueError, match="call `rerun.init"):
        pliant.to_rerun(recorded)


def test_a_live_view_runs_a_copy_in_a_page_of_this_machine() -> None:
    simulation = pliant.Simulation(beam())
    simulation.step(20)
    with simulation.view(live=True, height=250) as view:
        [(tag, attributes)] = Tags(view._repr_html_()).found
        assert (
            tag == "iframe"
            and attributes["src"] == view.url
            and "height: 250px" in (attributes["style"] or "")
        )
        assert view.url.startswith("http://127.0.0.1:") and view.is_running
        with urllib.request.urlopen(view.url, timeout=10) as answer:
            ancestors = answer.headers["Content-Security-Policy"]
            assert answer.headers["X-Frame-Options"] is None
            assert b"<canvas" in answer.read()
        assert ancestors.startswith("frame-ancestors http://localhost:*") and "*:*" not in ancestors
        with pytest.raises(urllib.error.HTTPError, match="404"):
            urllib.request.urlopen(view.url[:-3] + "xx/", timeout=10)
        # Paced to real time: some steps of the page, none of the simulation.
        time.sleep(0.3)
        ended = view.stop()
        assert not view.is_running and repr(view) == "<pliant.LiveView, stopped>"
        with pytest.raises(RuntimeError, match="stopped before"):
            view.stop()
    assert simulation.steps == 20 and ended.steps > 20
    # The same steps with the same bits, from where the page began.
    simulation.step(ended.steps - 20)
    assert np.array_equal(simulation.positions, ended.positions)


def test_a_page_cannot_run_what_no_scene_says() -> None:
    simulation = pliant.Simulation(beam())
    simulation.pin([4], name="tip")
    with pytest.raises(ValueError, match="pins added by `pin`"):
        simulation.view(live=True)
    with pytest.raises(ValueError, match="`height`"):
        pliant.Simulation(beam()).view(live=True, height=0)
