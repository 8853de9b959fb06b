"""What `upt export` writes for ParaView, read by VTK itself."""

import os
import subprocess
from pathlib import Path

import numpy as np
import pytest
import pyvista

from upt_training.dataset import Trajectory, open_trajectory
from upt_training.mesh_file import Mesh, load_mesh

ROOT = Path(__file__).resolve().parents[2]
UPT = ROOT / "target" / "release" / ("upt.exe" if os.name == "nt" else "upt")
MESH = ROOT / "tests/fixtures/box.mesh.safetensors"

if not UPT.exists():
    pytest.skip(f"{UPT} is not built: cargo build --release -p upt-cli", allow_module_level=True)


def upt(*words: str | Path) -> None:
    done = subprocess.run([str(UPT), *map(str, words)], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


@pytest.fixture(scope="module")
def pushed(tmp_path_factory) -> tuple[Mesh, Trajectory]:
    """The box under a push, and what was simulated."""
    file = tmp_path_factory.mktemp("push") / "push.trajectory.safetensors"
    upt("simulate", "--mesh", MESH, "--scheme", "1", "--out", file)
    mesh = load_mesh(MESH)
    return mesh, open_trajectory(file, mesh)


def export(pushed: tuple[Mesh, Trajectory], *words: str | Path) -> None:
    upt("export", pushed[1].path, "--mesh", MESH, *words)


def test_frames_are_listed_with_their_times_and_hold_the_deformed_body(pushed, tmp_path: Path) -> None:
    mesh, trajectory = pushed
    export(pushed, "--out", tmp_path, "--every", "40")
    reader = pyvista.get_reader(tmp_path / "trajectory.pvd")
    frames = range(0, trajectory.frame_count, 40)
    assert len(frames) >= 4
    step = float(trajectory.metadata["dt_s"])
    np.testing.assert_allclose(reader.time_values, [frame * step for frame in frames])
    moved = trajectory.read()
    for row, frame in enumerate(frames):
        reader.set_active_time_point(row)
        (grid,) = reader.read()
        assert (grid.celltypes == pyvista.CellType.TETRA).all()
        np.testing.assert_array_equal(grid.cells_dict[pyvista.CellType.TETRA], mesh.tets)
        np.testing.assert_array_equal(grid.points, mesh.positions + moved[frame])
        np.testing.assert_array_equal(grid.point_data["displacement"], moved[frame])
        touched = np.zeros(mesh.node_count, np.uint8)
        touched[trajectory.contact(frame)[0]] = 1
        np.testing.assert_array_equal(grid.point_data["contact"], touched)


def test_a_skin_at_rest_has_the_surface_only(pushed, tmp_path: Path) -> None:
    mesh = pushed[0]
    export(pushed, "--out", tmp_path, "--every", "80", "--skin", "--rest")
    grid = pyvista.read(tmp_path / "frame-00080.vtu")
    triangles = grid.cells_dict[pyvista.CellType.TRIANGLE]
    np.testing.assert_array_equal(grid.points[triangles], mesh.positions[mesh.surface])
    assert len(grid.points) == len(np.unique(mesh.surface))
