"""Wrong input: a message that names file and cause, exit code 2, nothing written."""

import json
import shutil
from pathlib import Path

import numpy as np
import pytest
import torch
from conftest import CONFIGS
from safetensors.numpy import load_file, save_file

from upt_training.__main__ import main
from upt_training.box_mesh import box_mesh
from upt_training.dataset import open_dataset
from upt_training.errors import InputError
from upt_training.evaluate import check_tissue
from upt_training.mesh_file import load_mesh
from upt_training.trainer import load_checkpoint


def run(data, mesh, out, *more):
    arguments = [
        "train",
        "--config",
        str(CONFIGS / "tiny.toml"),
        "--data",
        str(data),
        "--mesh",
        str(mesh),
    ]
    return main([*arguments, "--out", str(out), *more])


@pytest.fixture()
def copy(data, tmp_path):
    shutil.copytree(data, tmp_path / "data", ignore=shutil.ignore_patterns(".cache"))
    return tmp_path / "data"


def expect(capsys, code, *words):
    assert code == 2
    text = capsys.readouterr().err
    assert all(word in text for word in words), text


def test_dataset_of_another_mesh(copy, tmp_path, capsys):
    other = tmp_path / "other.mesh.safetensors"
    box_mesh((4, 4, 4)).save(other)
    expect(capsys, run(copy, other, tmp_path / "run"), "another mesh", "manifest.json")
    assert not (tmp_path / "run").exists()


def test_dataset_of_another_tissue(data, mesh_path):
    dataset = open_dataset(data, load_mesh(mesh_path))
    own = dataset.manifest["material"]
    check_tissue({**own, "damping_per_s": 5.0}, dataset)
    with pytest.raises(InputError, match="young_pa is 3000, the bundle is made for 5000.*--young"):
        check_tissue({**own, "young_pa": 5000}, dataset)


def test_truncated_trajectory(copy, mesh_path, tmp_path, capsys):
    file = sorted(copy.glob("case-*"))[1]
    file.write_bytes(file.read_bytes()[:-1000])
    expect(capsys, run(copy, mesh_path, tmp_path / "run"), file.name, "truncated")
    assert not (tmp_path / "run").exists()


def test_nan_in_the_data(copy, mesh_path, tmp_path, capsys):
    file = sorted(copy.glob("case-*"))[2]
    tensors = load_file(str(file))
    tensors["displacement"][4, 17, 1] = np.nan
    header = file.read_bytes()
    length = int.from_bytes(header[:8], "little")
    metadata = json.loads(header[8 : 8 + length])["__metadata__"]
    save_file(tensors, str(file), metadata=metadata)
    expect(capsys, run(copy, mesh_path, tmp_path / "run"), file.name, "displacement[4, 17, 1]")


def test_missing_files_and_unknown_fields(copy, mesh_path, tmp_path, capsys):
    expect(capsys, run(tmp_path / "nowhere", mesh_path, tmp_path / "run"), "manifest.json")
    bad = tmp_path / "bad.toml"
    bad.write_text("[model]\nencodr = 5\n")
    code = main(
        [
            "train",
            "--config",
            str(bad),
            "--data",
            str(copy),
            "--mesh",
            str(mesh_path),
            "--out",
            str(tmp_path / "r"),
        ]
    )
    expect(capsys, code, "encodr", "bad.toml")


@pytest.mark.skipif(torch.cuda.is_available(), reason="a CUDA device is present")
def test_missing_device(copy, mesh_path, tmp_path, capsys):
    expect(capsys, run(copy, mesh_path, tmp_path / "run", "--device", "cuda"), "cuda", "--device cpu")


def test_prior_is_asked_for(copy, mesh_path, tmp_path, capsys):
    code = main(
        [
            "train",
            "--config",
            str(CONFIGS / "brain-coarse.toml"),
            "--data",
            str(copy),
            "--mesh",
            str(mesh_path),
        ]
    )
    expect(capsys, code, "--prior")


def test_broken_checkpoint(tmp_path, mesh_path, capsys):
    (tmp_path / "last.pt").write_bytes(b"not a checkpoint")
    code = main(["export", str(tmp_path), "--out", str(tmp_path / "bundle"), "--mesh", str(mesh_path)])
    expect(capsys, code, "last.pt")
    assert not (tmp_path / "bundle").exists()


class Code:
    def __init__(self, target):
        self.target = target

    def __reduce__(self):
        return (Path.touch, (self.target,))


def test_a_checkpoint_with_code_in_it_runs_none(tmp_path):
    target = tmp_path / "ran"
    torch.save({"format": "upt-checkpoint", "model": Code(target)}, tmp_path / "last.pt")
    with pytest.raises(InputError, match=r"last\.pt: not a readable checkpoint"):
        load_checkpoint(tmp_path / "last.pt")
    assert not target.exists()


def test_element_stiffness_is_kept_hashed_and_checked(tmp_path):
    mesh = box_mesh((2, 2, 2))
    uniform = mesh.sha256
    mesh.stiffness = np.full(len(mesh.tets), 3, np.float32)
    path = tmp_path / "stiff.mesh.safetensors"
    mesh.save(path)
    assert load_mesh(path).sha256 == mesh.sha256 != uniform
    for bad in (np.nan, 0.0, -1.0):
        mesh.stiffness[4] = bad
        mesh.save(path)
        with pytest.raises(InputError, match="stiffness"):
            load_mesh(path)
    mesh.stiffness = np.ones(1, np.float32)
    mesh.save(path)
    with pytest.raises(InputError, match="stiffness"):
        load_mesh(path)
