"""What training keeps in memory on a dataset much larger than that: the largest resident set of a `train` command.

    python training/tables data_memory --config CONFIG.toml --mesh MESH [--prior PRIOR] [--vibration VIBRATION]
        [--cases 200] [--frames 161]

Makes a dataset of that size in a temporary folder out of sparse files (a moving contact, all other displacements are
holes that read as zeros), runs the command on it for `--seconds`, and reads how large it became. Mapped pages
of data count as resident, those of the temporary folder's cache too.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

from upt_training.mesh_file import Mesh, load_mesh

COLUMNS = [
    "configuration",
    "K",
    "trajectories",
    "displacements, GB",
    "node subset on disk, GB",
    "steps",
    "largest resident set, GB",
]
MARKS, KEY = "data memory", 2
PATCH_MM, PUSH_MM = 8.0, 6.0


def write_sparse_case(path: Path, mesh: Mesh, frames: int, scheme: str, site: int) -> int:
    """A push around the domain node `site`; returns the bytes of its displacements, which take no room on disk."""
    near = np.flatnonzero(np.linalg.norm(mesh.positions - mesh.positions[site], axis=1) < PATCH_MM)
    near = np.intersect1d(near, mesh.domain_nodes)
    amount = PUSH_MM * np.sin(np.pi * np.arange(1, frames) / frames)
    vectors = np.zeros((frames - 1, len(near), 3), np.float32)
    vectors[..., 2] = -amount[:, None]
    small = {
        "contact_offsets": np.concatenate([[0], np.arange(frames) * len(near)]).astype("<i4"),
        "contact_nodes": np.tile(near, frames - 1).astype("<i4"),
        "contact_vectors": vectors.reshape(-1, 3).astype("<f4"),
    }
    header, end = {}, 0
    for name, array in small.items():
        kind = "I32" if array.dtype.kind == "i" else "F32"
        header[name] = {"dtype": kind, "shape": array.shape, "data_offsets": [end, end + array.nbytes]}
        end += array.nbytes
    size = frames * mesh.node_count * 3 * 4
    shape = [frames, mesh.node_count, 3]
    header["displacement"] = {"dtype": "F32", "shape": shape, "data_offsets": [end, end + size]}
    header["__metadata__"] = {"mesh_sha256": mesh.sha256, "scheme": scheme, "boundary": "fixed", "dt_s": "0.05"}
    text = json.dumps(header).encode()
    text += b" " * (-len(text) % 8)
    with path.open("wb") as file:
        file.write(len(text).to_bytes(8, "little") + text)
        for array in small.values():
            file.write(array.tobytes())
        file.truncate(8 + len(text) + end + size)
    return size


def write_sparse_dataset(data: Path, mesh: Mesh, cases: int, frames: int) -> int:
    """A dataset folder; returns the bytes of all displacements. The last case is held out."""
    data.mkdir(parents=True)
    draw, entries, size = np.random.default_rng(1), [], 0
    for index in range(cases):
        file, scheme = f"case-{index:05d}.trajectory.safetensors", str(1 + index % 4)
        size += write_sparse_case(data / file, mesh, frames, scheme, int(draw.choice(mesh.domain_nodes)))
        split = "test" if index == cases - 1 else "train"
        entries.append({"index": index, "file": file, "scheme": scheme, "seed": index, "split": split})
        entries[-1]["status"] = "done"
    manifest = {"format": "upt-dataset", "version": 1, "mesh_sha256": mesh.sha256}
    manifest |= {"boundary": "fixed", "seed": 1, "cases": entries}
    (data / "manifest.json").write_text(json.dumps(manifest))
    return size


def largest_resident_set(command: list[str]) -> tuple[int, str]:
    """Bytes at the highest point of the process (as `VmHWM`), and what it printed."""
    with tempfile.TemporaryFile("w+") as output:
        process = subprocess.Popen(command, stdout=output, cwd=Path(__file__).parents[1])
        _, status, usage = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
        output.seek(0)
        text = output.read()
    if process.returncode != 0:
        sys.exit(f"error: {' '.join(command)} ended with {process.returncode}\n{text}")
    return usage.ru_maxrss * 1024, text


def arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--config", type=Path, required=True)
    parser.add_argument("--mesh", type=Path, required=True)
    parser.add_argument("--prior", type=Path)
    parser.add_argument("--vibration", type=Path)
    parser.add_argument("--cases", type=int, default=200)
    parser.add_argument("--frames", type=int, default=161)
    parser.add_argument("--seconds", type=float, default=12.0, help="training time; reading the data is not counted")


def rows(options: argparse.Namespace) -> list[list[str]]:
    mesh = load_mesh(options.mesh)
    with tempfile.TemporaryDirectory() as folder:
        data = Path(folder) / "data"
        size = write_sparse_dataset(data, mesh, options.cases, options.frames)
        command = [sys.executable, "-m", "upt_training", "train", "--device", "cpu", "--data", str(data)]
        command += ["--out", f"{folder}/run", "--max-minutes", str(options.seconds / 60)]
        for name in ("config", "mesh", "prior", "vibration"):
            if getattr(options, name):
                command += [f"--{name}", str(getattr(options, name).resolve())]
        resident, text = largest_resident_set(command)
        subset = sum(path.stat().st_size for path in (data / ".cache").rglob("*.npy"))
    print(text, file=sys.stderr)
    steps = text.rsplit("at step ", 1)[1].split(";")[0]
    cells = [f"`{options.config.stem}`", f"{mesh.node_count:,}", str(options.cases), f"{size / 1e9:.2f}"]
    return [[*cells, f"{subset / 1e9:.2f}", steps, f"{resident / 1e9:.2f}"]]
