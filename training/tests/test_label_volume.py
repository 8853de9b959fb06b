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


def nrrd(volume: np.ndarray, space: str = "right-anterior-superior", scale: float = 1.0, more: str = "") -> bytes:
    """The volume as 3D Slicer writes it, in either of the spaces that it uses."""
    matrix = AFFINE[:3] * scale
    if space.startswith("left"):
        matrix = np.diag([-1, -1, 1]) @ matrix
    steps = [f"({','.join(str(x) for x in column)})" for column in matrix.T]
    head = f"NRRD0004\ntype: uint8\ndimension: 3\nspace: {space}\nsizes: {' '.join(map(str, volume.shape))}\n"
    head += f"space directions: {' '.join(steps[:3])}\nkinds: domain domain domain\n"
    head += f"encoding: raw\n{more}space origin: {steps[3]}\n\n"
    return head.encode() + volume.tobytes(order="F")


def mha(volume: np.ndarray) -> bytes:
    """The volume as ITK writes it: x to the left, y to the back."""
    head = "ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = False\nCompressedData = False\n"
    head += "TransformMatrix = 1 0 0 0 -1 0 0 0 1\nOffset = -50 40 -30\nElementSpacing = 4 4 4\n"
    head += f"DimSize = {' '.join(map(str, volume.shape))}\nElementType = MET_UCHAR\nElementDataFile = LOCAL\n"
    return head.encode() + volume.tobytes(order="F")


def nifti(volume: np.ndarray, unit: str = "mm", scale: float = 1.0) -> bytes:
    """The volume with its affine in another unit."""
    image = nibabel.Nifti1Image(volume, np.diag([scale, scale, scale, 1]) @ AFFINE)
    image.header.set_xyzt_units(unit)
    return image.to_bytes()


def box(folder: Path) -> np.ndarray:
    """The lowest and the highest corner of the body that was made."""
    positions = load_file(folder / "organ.work" / "mesh.safetensors")["positions"]
    return np.array([positions.min(0), positions.max(0)])


SEGMENT = "Segment0_Name:=capsule\nSegment0_LabelValue:=1\n"
UNITS = 'space units: "m" "m" "m"\n'


@pytest.mark.parametrize(
    ("name", "content", "said"),
    [
        ("trailing.nii", nifti(labels()[..., None, None]), "label 5"),
        ("metre.nii", nifti(labels(), "meter", 1e-3), "unit is meter"),
        ("micron.nii", nifti(labels(), "micron", 1e3), "unit is micron"),
        ("none.nii", nifti(labels(), "unknown"), "label 5"),
        ("wide.nii", nifti(labels().astype(np.float64)), "label 5"),
        ("slicer.nrrd", nrrd(labels(), "left-posterior-superior", more=SEGMENT), "label 1 (capsule)"),
        ("right.nrrd", nrrd(labels()), "label 5"),
        ("metre.nrrd", nrrd(labels(), scale=1e-3, more=UNITS), "unit is m"),
        ("itk.mha", mha(labels()), "label 5"),
    ],
)
def test_every_form_gives_the_same_body_in_mm(tmp_path: Path, name: str, content: bytes, said: str) -> None:
    (tmp_path / name).write_bytes(content)
    made = make(tmp_path / name, "--fixed", "plane:0,0,-1,-12")
    assert made.returncode == 0, made.stderr
    assert said in made.stderr, made.stderr
    np.testing.assert_allclose(box(tmp_path), [[-32, -30, -24], [40, 26, 24]], atol=2.5)


def test_a_surface_of_slicer_is_turned_to_the_volume_beside_it(tmp_path: Path) -> None:
    volume = save(tmp_path / "organ.nii.gz", labels())
    made = make(volume, "--fixed", "plane:0,0,-1,-12")
    assert made.returncode == 0, made.stderr
    # A box about (24, 6, 0) mm, which is (-24, -6, 0) in LPS.
    corners = [(x, y, z) for z in (-6, 6) for y in (-12, 0) for x in (-30, -18)]
    faces = [(1, 3, 4, 2), (5, 6, 8, 7), (1, 2, 6, 5), (3, 7, 8, 4), (1, 5, 7, 3), (2, 4, 8, 6)]
    lines = ["# 3D Slicer output. SPACE=LPS"]
    lines += [f"v {x} {y} {z}" for x, y, z in corners]
    lines += [f"f {a} {b} {c}\nf {a} {c} {d}" for a, b, c, d in faces]
    part = tmp_path / "tumour.obj"
    part.write_text("\n".join(lines) + "\n")
    made = make(volume, "--fixed", "plane:0,0,-1,-12", "--stiffness", f"inside:{part}=4")
    assert made.returncode == 0, made.stderr
    mesh = load_file(tmp_path / "organ.work" / "mesh.safetensors")
    middles = mesh["positions"][mesh["tets"]].mean(1)[mesh["stiffness"] == 4]
    assert len(middles) and (np.abs(middles - [24, 6, 0]) <= 6).all()


def test_a_volume_of_a_scan_is_cropped_and_one_that_unpacks_to_a_gigabyte_is_refused(tmp_path: Path) -> None:
    resource = pytest.importorskip("resource")
    wide = np.zeros((300, 400, 200), np.uint8)
    wide[200:224, 300:320, 100:116] = labels()
    nibabel.save(nibabel.Nifti1Image(wide, AFFINE), tmp_path / "wide.nii.gz")
    head = nibabel.Nifti1Image(np.zeros((2, 2, 2), np.uint8), AFFINE).header
    head.set_data_shape((1000, 1000, 1000))
    with gzip.open(tmp_path / "bomb.nii.gz", "wb") as file:
        file.write(bytes(head.binaryblock)[:108] + np.float32(352).tobytes() + bytes(head.binaryblock)[112:] + bytes(4))
        for _ in range(120):
            file.write(bytes([1]) * 10**6)

    def convert(name: str) -> subprocess.CompletedProcess[str]:
        command = [
            sys.executable,
            str(ROOT / "crates/foreign/src/labels.py"),
            str(tmp_path / name),
            str(tmp_path / "out.ply"),
        ]
        # A gigabyte of memory that is used; libraries and threads reserve more.
        limit = lambda: resource.setrlimit(resource.RLIMIT_DATA, (2 << 30, 2 << 30))  # noqa: E731
        return subprocess.run(command, capture_output=True, text=True, preexec_fn=limit, check=False)

    assert convert("wide.nii.gz").returncode == 0
    bomb = convert("bomb.nii.gz")
    assert bomb.returncode == 1 and "million voxels" in bomb.stderr.splitlines()[-1], bomb.stderr


def test_an_affine_of_zeros_is_named(tmp_path: Path) -> None:
    content = bytearray(nifti(labels()))
    content[280:328] = bytes(48)
    (tmp_path / "flat.nii").write_bytes(content)
    made = make(tmp_path / "flat.nii", "--fixed", "all")
    assert made.returncode == 2 and "affine" in made.stderr and "flat.nii" in made.stderr


def test_mesh_import_reads_label_volumes(tmp_path: Path) -> None:
    volume = save(tmp_path / "organ.nii.gz", labels())
    out = tmp_path / "ball.mesh.safetensors"
    command = [str(UPT), "mesh", "import", str(volume), str(out), "--nodes", "300", "--label", "5"]
    environment = {**os.environ, "UPT_PYTHON": sys.executable}
    made = subprocess.run(command, capture_output=True, text=True, env=environment, check=False)
    assert made.returncode == 0, made.stderr
    np.testing.assert_allclose(np.ptp(load_file(out)["positions"], axis=0), [24, 24, 24], atol=4)


def test_the_labels_that_are_asked_for_are_the_body(tmp_path: Path) -> None:
    """Of an ellipsoid around a ball: the ball, the ellipsoid with a void in it, or both as one."""
    volume = save(tmp_path / "organ.nii.gz", labels())

    def held(label: str) -> float:
        made = make(volume, "--label", label, "--fixed", "plane:0,0,-1,-8")
        assert made.returncode == 0, made.stderr
        mesh = load_file(tmp_path / "organ.work" / "mesh.safetensors")
        corners = mesh["positions"][mesh["tets"]].astype(np.float64)
        return float(np.linalg.det(corners[:, 1:] - corners[:, :1]).sum()) / 6

    for label, wanted in (("5", labels() == 5), ("1,5", labels() > 0), ("1", labels() == 1)):
        # A ball of three voxels loses a quarter to the blur.
        assert 0.7 < held(label) / (64 * np.count_nonzero(wanted)) < 1.1, label
    missing = make(volume, "--label", "7", "--fixed", "plane:0,0,-1,-8")
    assert missing.returncode == 2
    assert "no voxel has label 7; the volume has 1, 5" in missing.stderr


@pytest.mark.parametrize(
    ("name", "volume", "said"),
    [
        ("noise", np.arange(1, 4097, dtype=np.int16).reshape(16, 16, 16), "is it a scan?"),
        ("empty", np.zeros((8, 8, 8), np.uint8), "no label but 0"),
        ("series", np.ones((4, 4, 4, 2), np.uint8), "shape (4, 4, 4, 2)"),
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
        "half.nrrd": nrrd(labels())[:-4000],
        "text.mha": b"not a volume\n" * 40,
    }
    for name, content in files.items():
        (tmp_path / name).write_bytes(content)
        made = make(tmp_path / name, "--fixed", "all")
        assert made.returncode == 2, name
        assert "whole?" in made.stderr and name in made.stderr, made.stderr
        assert not (tmp_path / "organ").exists()
