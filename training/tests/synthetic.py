"""A synthetic dataset on the box mesh: a damped, smoothed answer to a push; cheap, and not trivial to copy."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
from safetensors.numpy import save_file

from upt_training.box_mesh import box_mesh


def write_dataset(folder: Path, cases: int = 10, frames: int = 21, seed: int = 0) -> Path:
    """`folder/data` (dataset) and `folder/box.mesh.safetensors`; returns the dataset's folder."""
    mesh = box_mesh()
    mesh.save(folder / "box.mesh.safetensors")
    data = folder / "data"
    data.mkdir(parents=True)
    generator = np.random.default_rng(seed)
    entries = []
    for index in range(cases):
        scheme = str(1 + index % 2)
        file = f"case-{index:05d}.trajectory.safetensors"
        write_case(data / file, mesh, frames, scheme, generator)
        split = "test" if (index // 2) % 5 == 4 else "train"
        entries.append(
            {
                "index": index,
                "file": file,
                "scheme": scheme,
                "seed": index,
                "split": split,
                "status": "done",
            }
        )
    material = {"young_pa": 3000, "poisson": 0.49, "density_kg_m3": 1000, "damping_per_s": 20}
    manifest = {
        "format": "upt-dataset",
        "version": 1,
        "mesh_name": "box",
        "mesh_sha256": mesh.sha256,
    }
    manifest |= {"boundary": "fixed", "material": material, "seed": seed, "cases": entries}
    (data / "manifest.json").write_text(json.dumps(manifest))
    return data


def write_case(path: Path, mesh, frames: int, scheme: str, generator) -> None:
    p = mesh.positions.astype(np.float64)
    centre = p[generator.choice(mesh.domain_nodes)]
    near = mesh.domain_nodes[np.linalg.norm(p[mesh.domain_nodes] - centre, axis=1) < 14.0]
    direction = np.array([0.3 * generator.standard_normal(), 0.3 * generator.standard_normal(), -1.0])
    spread = np.exp(-(np.linalg.norm(p - centre, axis=1) ** 2) / (2 * 18.0**2))[:, None] * (p[:, 2:] / p[:, 2].max())
    release = int(0.8 * frames)
    u, answer = np.zeros((frames, len(p), 3)), np.zeros((len(p), 3))
    offsets, nodes, vectors = [0, 0], [], []
    for t in range(1, frames):
        amount = 8.0 * min(1.0, t / (0.5 * frames)) if t < release else 0.0
        answer = answer + 0.5 * (amount * spread * direction - answer)
        u[t] = answer
        u[t, mesh.fixed] = 0.0
        if t < release:
            c = np.broadcast_to(amount * direction, (len(near), 3))
            u[t, near] = c
            nodes.append(near)
            vectors.append(c)
        offsets.append(offsets[-1] + (len(near) if t < release else 0))
    tensors = {
        "displacement": u.astype(np.float32),
        "contact_offsets": np.asarray(offsets, np.int32),
        "contact_nodes": np.concatenate(nodes).astype(np.int32),
        "contact_vectors": np.ascontiguousarray(np.concatenate(vectors), np.float32),
    }
    metadata = {
        "format": "upt-trajectory",
        "version": "1",
        "mesh_sha256": mesh.sha256,
        "scheme": scheme,
    }
    metadata |= {"boundary": "fixed", "seed": "0", "site": json.dumps(centre.tolist())}
    save_file(tensors, str(path), metadata=metadata)
