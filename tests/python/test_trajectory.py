"""Recordings, read back."""

from __future__ import annotations

import pickle
import subprocess
import sys
from pathlib import Path

import numpy as np
import pliant
import pytest
from conftest import SCENES, beam


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> tuple[pliant.Trajectory, list[pliant.Frame]]:
    path = tmp_path_factory.mktemp("recorded") / "beam.mcap"
    frames: list[pliant.Frame] = []
    channels = ["state", "mesh", "energy", "reactions", "von-mises"]
    scene = beam(**{"output.channels": channels, "title": "A beam"})
    pliant.Simulation(scene).run(record=path, callback=frames.append)
    return pliant.load(path), frames


def test_frames_are_those_that_were_shown(recorded: tuple[pliant.Trajectory, list[pliant.Frame]]) -> None:
    trajectory, frames = recorded
    assert len(trajectory) == len(frames) == 7
    for i, frame in enumerate(frames):
        np.testing.assert_array_equal(trajectory.positions[i], frame.positions)
        np.testing.assert_array_equal(trajectory.velocities[i], frame.velocities)
        assert abs(trajectory.times[i] - frame.time) < 1e-9
        assert trajectory.energy["total"][i] == frame.energy["total"]
    assert trajectory.energy["time"].tolist() == [frame.time for frame in frames]


def test_frames_are_indexed_like_arrays(recorded: tuple[pliant.Trajectory, list[pliant.Frame]]) -> None:
    lazy = recorded[0].positions
    assert lazy.shape == (7, 10, 2) and len(lazy) == 7
    whole = np.asarray(lazy)
    assert whole.shape == lazy.shape and whole.dtype == np.float64
    for index in (
        0,
        -1,
        np.int64(3),
        slice(None),
        slice(1, 6, 2),
        slice(None, None, -1),
        [0, 5, -1],
        np.array([2, 2]),
    ):
        np.testing.assert_array_equal(lazy[index], whole[index])
    np.testing.assert_array_equal(lazy[2, 3:5], whole[2, 3:5])
    np.testing.assert_array_equal(lazy[:, 9, 1], whole[:, 9, 1])
    np.testing.assert_array_equal(np.stack(list(lazy)), whole)
    for wrong in (7, -8):
        with pytest.raises(IndexError):
            lazy[wrong]


def test_a_recording_knows_what_it_is_of(recorded: tuple[pliant.Trajectory, list[pliant.Frame]]) -> None:
    trajectory = recorded[0]
    simulation = pliant.Simulation(beam())
    np.testing.assert_array_equal(trajectory.rest_positions, simulation.rest_positions)
    np.testing.assert_array_equal(trajectory.masses, simulation.masses)
    np.testing.assert_array_equal(trajectory.topology["beam"]["tri"], simulation.bodies[0]["triangles"])
    assert trajectory.metadata["title"] == trajectory.scene.title == "A beam"
    assert trajectory.metadata["outcome"]["status"] == "completed"
    simulation = pliant.Simulation(trajectory.scene)
    simulation.run()
    np.testing.assert_array_equal(trajectory.positions[-1], simulation.positions)
    assert trajectory.measure("von-mises").shape == (7, 8, 1)
    np.testing.assert_allclose(
        trajectory.measure("von-mises")[-1, :, 0], simulation.stress("von-mises"), rtol=1e-12
    )
    np.testing.assert_allclose(
        trajectory.reactions["beam/left.force[1]"][-1], simulation.reactions()["beam/left"][0, 1]
    )
    again = pickle.loads(pickle.dumps(trajectory))
    np.testing.assert_array_equal(again.positions[3], trajectory.positions[3])


def test_what_is_not_there_is_said(
    recorded: tuple[pliant.Trajectory, list[pliant.Frame]], tmp_path: Path
) -> None:
    with pytest.raises(KeyError, match="green-strain"):
        recorded[0].measure("green-strain")
    with pytest.raises(ValueError, match="there is no measure"):
        recorded[0].measure("strain")
    with pytest.raises(KeyError, match="tip"):
        recorded[0].probe("tip")
    with pytest.raises(FileNotFoundError):
        pliant.load(tmp_path / "absent.mcap")
    (tmp_path / "text.mcap").write_text("no recording")
    with pytest.raises(ValueError, match="not an MCAP file"):
        pliant.load(tmp_path / "text.mcap")


@pytest.mark.parametrize(
    ("name", "kind", "cells"),
    [
        ("twisted_bar", "tetra", 4),
        ("twisted_bar_quadratic", "tetra10", 10),
        ("strand", "line", 2),
        ("kepler", "vertex", 1),
    ],
)
def test_frames_go_to_meshio_and_pyvista(name: str, kind: str, cells: int, tmp_path: Path) -> None:
    meshio = pytest.importorskip("meshio")
    pytest.importorskip("pyvista")
    simulation = pliant.Simulation(pliant.Scene.from_toml(SCENES / f"{name}.toml"))
    simulation.run(until=simulation.step_size, record=tmp_path / "out.mcap")
    trajectory = pliant.load(tmp_path / "out.mcap")
    mesh, grid = trajectory.to_meshio(), trajectory.to_pyvista()
    assert {block.type for block in mesh.cells} == {kind} and mesh.cells[0].data.shape[1] == cells
    count = sum(len(block.data) for block in mesh.cells)
    assert grid.n_cells == count > 0 and grid.n_points == trajectory.vertex_count
    np.testing.assert_array_equal(mesh.points[:, : trajectory.dimension], simulation.positions)
    np.testing.assert_array_equal(grid.points, mesh.points)
    mesh.write(tmp_path / "out.vtu")
    np.testing.assert_array_equal(meshio.read(tmp_path / "out.vtu").points, mesh.points)


def test_energies_go_to_pandas(recorded: tuple[pliant.Trajectory, list[pliant.Frame]]) -> None:
    pytest.importorskip("pandas")
    table = recorded[0].to_pandas()
    assert table.index.name == "time" and table.shape[0] == 7
    np.testing.assert_array_equal(table["kinetic"], recorded[0].energy["kinetic"])


def test_probes_and_every_channel_are_read(tmp_path: Path) -> None:
    # Nothing touches here.
    channels = [name for name in pliant.catalogue("channels") if not name.startswith("contact")]
    scene = pliant.Scene.from_toml(beam().to_toml() + '\n[[probe]]\nname = "tip"\nvertex = 9\n')
    scene = scene.with_changes({"output.channels": channels})
    simulation = pliant.Simulation(scene)
    simulation.run(record=tmp_path / "out.mcap")
    trajectory = pliant.load(tmp_path / "out.mcap")
    tip = trajectory.probe("tip")
    for axis in range(2):
        np.testing.assert_array_equal(tip[f"position[{axis}]"], trajectory.positions[:, 9, axis])
        np.testing.assert_array_equal(tip[f"velocity[{axis}]"], trajectory.velocities[:, 9, axis])
    measured = 0
    for name in channels:
        try:
            expected = simulation.measure(name)
        except ValueError:
            continue
        np.testing.assert_array_equal(trajectory.measure(name)[-1], expected)
        measured += 1
    assert measured == len(MEASURES)
    # The stress at nodes, and its error.
    for kind, name in (("von-mises", "nodal-von-mises"), ("cauchy", "nodal-stress")):
        vertices, stress = simulation.nodal_stress(kind=kind)
        found = trajectory.measure(name)[-1]
        assert len(vertices) == len(found) == trajectory.vertex_count
        rows = stress[:, [0, 1, 2, 0, 1, 0], [0, 1, 2, 1, 2, 2]] if kind == "cauchy" else stress[:, None]
        np.testing.assert_array_equal(found[vertices], rows)
    error = trajectory.measure("zz")[-1]
    assert error.shape == (len(simulation.measure("jacobian")), 1) and (error >= 0).all()


def test_frames_are_exported_as_by_the_command_line(
    recorded: tuple[pliant.Trajectory, list[pliant.Frame]], programs: list[str], tmp_path: Path
) -> None:
    trajectory = recorded[0]
    files = trajectory.export(tmp_path / "ours", slice(1, None, 2))
    command = [programs[0], "export", trajectory.path, "--to", tmp_path / "theirs", "--frames", "1..:2"]
    subprocess.run(command, check=True, capture_output=True)
    assert [file.name for file in files] == ["beam_0001.vtu", "beam_0003.vtu", "beam_0005.vtu", "beam.pvd"]
    assert sorted(file.name for file in (tmp_path / "theirs").iterdir()) == sorted(
        file.name for file in files
    )
    for file in files:
        assert file.read_bytes() == (tmp_path / "theirs" / file.name).read_bytes()
    assert trajectory.export(tmp_path / "last.obj", -1) == [tmp_path / "last.obj"]
    with pytest.raises(FileExistsError, match="overwrite=True"):
        trajectory.export(tmp_path / "last.obj", 0)
    trajectory.export(tmp_path / "last.obj", 0, overwrite=True)
    with pytest.raises(IndexError):
        trajectory.export(tmp_path / "more", 7)
    for nothing in (slice(5, 2), slice(None, None, -1)):
        with pytest.raises(ValueError, match="chooses none of 7 frames"):
            trajectory.export(tmp_path / "none", nothing)
    with pytest.raises(ValueError, match="holds one frame, not 7 frames; choose one with `frames=`"):
        trajectory.export(tmp_path / "all.vtu")


def test_what_a_killed_run_left_is_recovered(tmp_path: Path) -> None:
    # Frames reach the system after a tenth of a second at the latest.
    code = """
import os, sys, time, pliant
scene = pliant.Scene.from_toml(sys.argv[1]).with_changes({"time.duration": 1e6})
start = []
def kill(frame):
    start.append(time.monotonic())
    if start[-1] > start[0] + 0.5:
        print(frame.index, flush=True)
        os.kill(os.getpid(), 9)
pliant.Simulation(scene).run(record=sys.argv[2], callback=kill)
"""
    out = tmp_path / "out.mcap"
    (tmp_path / "scene.toml").write_text(beam().to_toml())
    done = subprocess.run(
        [sys.executable, "-c", code, tmp_path / "scene.toml", out], stdout=subprocess.PIPE, text=True
    )
    assert done.returncode == -9 and not out.exists()
    recovered = pliant.recover(tmp_path / "out.mcap.part")
    assert 0 < len(recovered) <= int(done.stdout) + 1
    simulation = pliant.Simulation(beam())
    simulation.run(until=0.017)
    np.testing.assert_array_equal(recovered.positions[1], simulation.positions)
    with pytest.raises(FileExistsError):
        pliant.recover(tmp_path / "out.mcap.part")
    assert len(pliant.recover(tmp_path / "out.mcap.part", overwrite=True)) == len(recovered)
    with pytest.raises(ValueError, match="does not end in .part"):
        pliant.recover(out)
    with pytest.raises(FileNotFoundError):
        pliant.recover(tmp_path / "absent.part")


def test_meshes_carry_what_export_writes(tmp_path: Path) -> None:
    meshio = pytest.importorskip("meshio")
    pyvista = pytest.importorskip("pyvista")
    channels = ["state", *(name for name in pliant.catalogue("channels") if name in MEASURES | RECOVERED)]
    assert len(channels) == 1 + len(MEASURES) + len(RECOVERED)
    # Springs and particles are cells that are no elements.
    others = """
[[body]]
name = "rope"
mesh = { strand = { segments = 3, start = [0.0, 1.0], end = [1.0, 1.0] } }
springs = { stiffness = 1.0 }
mass = { total = 1.0 }
[[body]]
name = "dust"
mesh = { inline = { points = [[0.0, 2.0], [1.0, 2.0]] } }
mass = { total = 1.0 }
"""
    scene = pliant.Scene.from_toml(beam(**{"output.channels": channels}).to_toml() + others)
    pliant.Simulation(scene).run(until=0.05, record=tmp_path / "out.mcap")
    trajectory = pliant.load(tmp_path / "out.mcap")
    for frame in (0, 2):
        trajectory.export(tmp_path / "frame.vtu", frame, overwrite=True)
        written = {
            "meshio": meshio.read(tmp_path / "frame.vtu"),
            "pyvista": pyvista.read(tmp_path / "frame.vtu"),
        }
        mesh, grid = trajectory.to_meshio(frame), trajectory.to_pyvista(frame)
        assert set(mesh.cell_data) == set(written["meshio"].cell_data) == {"body", "zz", *MEASURES}
        points = {"displacement", "velocity", "nodal-von-mises", "nodal-stress"}
        points |= {f"principal-{k}" for k in (1, 2, 3)}
        assert set(mesh.point_data) == set(written["meshio"].point_data) == points
        for name in mesh.point_data:
            # Numbers of one component come back from files as rows of one.
            found = mesh.point_data[name]
            expected = written["meshio"].point_data[name].reshape(found.shape)
            np.testing.assert_array_equal(found, expected)
            np.testing.assert_array_equal(grid.point_data[name], written["pyvista"].point_data[name])
        for name in mesh.cell_data:
            # Numbers of one component come back from files as rows of one.
            found = np.concatenate(mesh.cell_data[name])
            expected = np.concatenate(written["meshio"].cell_data[name]).reshape(found.shape)
            np.testing.assert_array_equal(found, expected)
            np.testing.assert_array_equal(grid.cell_data[name], written["pyvista"].cell_data[name])
        np.testing.assert_array_equal(grid.celltypes, written["pyvista"].celltypes)
        assert (
            grid.field_data["TimeValue"][0]
            == written["pyvista"].field_data["TimeValue"][0]
            == trajectory.times[frame]
        )
        assert (
            np.isnan(mesh.cell_data["von-mises"][1]).all()
            and np.isfinite(mesh.cell_data["von-mises"][0]).all()
        )


MEASURES = {
    "deformation-gradient",
    "jacobian",
    "principal-stretches",
    "green-strain",
    "corotated-strain",
    "first-piola",
    "cauchy-stress",
    "von-mises",
    "energy-density",
}
RECOVERED = {"nodal-von-mises", "nodal-stress", "zz"}


def test_quantities_over_time_are_drawn(recorded: tuple[pliant.Trajectory, list[pliant.Frame]]) -> None:
    pytest.importorskip("matplotlib").use("Agg")
    trajectory = recorded[0]
    drawn = trajectory.plot()
    lines = {line.get_label(): line for line in drawn.get_lines()}
    assert {"total", "kinetic", "elastic"} <= lines.keys() and drawn.get_ylabel() == "energy [J]"
    for name, line in lines.items():
        np.testing.assert_array_equal(line.get_xdata(), trajectory.energy["time"])
        np.testing.assert_array_equal(line.get_ydata(), trajectory.energy[name])
    forces = trajectory.plot("reactions").get_lines()
    assert forces and all(".force[" in str(line.get_label()) for line in forces)
    momentum = trajectory.plot("linear_momentum", axes=drawn)
    assert momentum is drawn and "linear_momentum[1]" in [line.get_label() for line in drawn.get_lines()]
    with pytest.raises(ValueError, match="no `speed` to draw; it has energy, reactions"):
        trajectory.plot("speed")


def test_recordings_are_drawn(recorded: tuple[pliant.Trajectory, list[pliant.Frame]], tmp_path: Path) -> None:
    trajectory = recorded[0]
    still = trajectory.render(
        tmp_path / "still.png", at=0.0, size=(120, 90), colour_by="von-mises", bare=True
    )
    content = still.read_bytes()
    assert content.startswith(b"\x89PNG") and int.from_bytes(content[16:20], "big") == 120
    moving = trajectory.render(tmp_path / "moving.gif", frames=3, size=(64, 48))
    assert moving.read_bytes().startswith(b"GIF89a")
    with pytest.raises(FileExistsError, match="overwrite"):
        trajectory.render(still)
    trajectory.render(still, size=(60, 45), overwrite=True)
    assert int.from_bytes(still.read_bytes()[16:20], "big") == 60
    with pytest.raises(ValueError, match="heat"):
        trajectory.render(tmp_path / "other.png", colour_by="heat")
    with pytest.raises(ValueError, match="bmp"):
        trajectory.render(tmp_path / "other.bmp")
    assert {path.name for path in tmp_path.iterdir()} == {"still.png", "moving.gif"}
