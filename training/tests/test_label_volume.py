"""`upt make` from a NIfTI label volume: the body in mm, the stiffness of a label, and volumes that are refused."""

import gzip
import os
import subprocess
import sys
from pathlib import Path

import nibabel
import numpy as np
import pytest
from safetensors.numpy import load_file

ROOT = Path(__file__).resolve().parents[2]
UPT = ROOT / "target" / "release" / ("upt.exe" if os.name == "nt" else "upt")
# 4 mm a voxel; the first axis runs from right to left, as in most scans.
AFFINE = np.array([[-4.0, 0, 0, 50], [0, 4, 0, -40], [0, 0, 4, -30], [0, 0, 0, 1]])

if not UPT.exists():
    pytest.skip(f"{UPT} is not built: cargo build --release -p upt-cli", allow_module_level=True)


def labels() -> np.ndarray:
    """An ellipsoid of label 1 with half axes of 36, 28 and 24 mm about (4, -2, 0), and a ball of label 5 inside."""
    x, y, z = np.indices((24, 20, 16))
    volume = ((x - 11.5) / 9) ** 2 + ((y - 9.5) / 7) ** 2 + ((z - 7.5) / 6) ** 2 < 1
    ball = (x - 11.5) ** 2 + (y - 9.5) ** 2 + (z - 7.5) ** 2 < 3**2
    return np.where(ball, 5, volume).astype(np.uint8)


def save(path: Path, volume: np.ndarray) -> Path:
    nibabel.save(nibabel.Nifti1Image(volume, AFFINE), path)
    return path


def make(volume: Path, *more: str) -> subprocess.CompletedProcess[str]:
    out = volume.parent / "organ"
    command = [str(UPT), "make", str(volume), "--out", str(out), "--nodes", "600", "--preview", *more]
    environment = {**os.environ, "UPT_PYTHON": sys.executable}
    return subprocess.run(command, capture_output=True, text=True, env=environment, check=False)


def test_labels_become_one_body_with_the_stiffness_of_each(tmp_path: Path) -> None:
    volume = save(tmp_path / "organ.nii.gz", labels())
    part = tmp_path / "organ.work" / "label-5.ply"
    made = make(volume, "--fixed", "plane:0,0,-1,-12", "--stiffness", f"inside:{part}=4")
    assert made.returncode == 0, made.stderr
    assert "label 1" in made.stderr and "label 5" in made.stderr
    mesh = load_file(tmp_path / "organ.work" / "mesh.safetensors")
    positions, tets, stiffness = (mesh[name] for name in ("positions", "tets", "stiffness"))
    corners = positions[tets].astype(np.float64)
    sizes = np.linalg.det(corners[:, 1:] - corners[:, :1]) / 6
    assert (sizes > 0).all()
    # The blur takes a little off; 64 mm³ a voxel.
    assert abs(sizes.sum() / (64 * np.count_nonzero(labels())) - 1) < 0.1
    np.testing.assert_allclose(positions.mean(0), [4, -2, 0], atol=2)
    # The file's first axis runs from right to left: half axes go with the right axes of the body.
    np.testing.assert_allclose(np.ptp(positions, axis=0), [72, 56, 48], atol=5)
    assert set(np.unique(stiffness)) == {1.0, 4.0}
    stiff = corners[stiffness == 4].mean(1)
    assert np.linalg.norm(stiff - [4, -2, 0], axis=1).max() < 13


@pytest.mark.parametrize(
    ("name", "volume", "said"),
    [
        ("empty", np.zeros((8, 8, 8), np.uint8), "no label but 0"),
        ("series", np.ones((4, 4, 4, 2), np.uint8), "three axes"),
        ("scan", np.random.default_rng(1).random((8, 8, 8)).astype(np.float32), "whole numbers"),
        ("line", np.eye(8, dtype=np.uint8)[:, :, None].repeat(1, 2), "thinner than two voxels"),
    ],
)
def test_volumes_that_hold_no_body_are_refused(tmp_path: Path, name: str, volume: np.ndarray, said: str) -> None:
    made = make(save(tmp_path / f"{name}.nii", volume), "--fixed", "all")
    assert made.returncode == 2
    assert said in made.stderr and f"{name}.nii" in made.stderr


def test_files_that_are_cut_off_or_something_else_are_refused(tmp_path: Path) -> None:
    whole = save(tmp_path / "whole.nii.gz", labels())
    plain = gzip.decompress(whole.read_bytes())
    files = {
        "half.nii.gz": whole.read_bytes()[: whole.stat().st_size // 2],
        "half.nii": plain[: len(plain) // 2],
        "header.nii": plain[:100],
        "text.nii": b"not a volume\n" * 40,
    }
    for name, content in files.items():
        (tmp_path / name).write_bytes(content)
        made = make(tmp_path / name, "--fixed", "all")
        assert made.returncode == 2, name
        assert "whole?" in made.stderr and name in made.stderr, made.stderr
        assert not (tmp_path / "organ").exists()
