"""Runs a reduced bundle as the runtime does (numpy and ONNX Runtime): the reference of the Rust scene."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import onnxruntime

from upt_training.bundle_folder import file_of
from upt_training.errors import InputError
from upt_training.lend import Lender
from upt_training.mesh_file import load_mesh
from upt_training.reduced.prior import load_prior


class ReducedRunner:
    """State of one scene: `b`, the step before, and the bound `E`."""

    def __init__(self, folder: Path | str) -> None:
        folder = Path(folder)
        self.manifest = json.loads((folder / "bundle.json").read_text())
        if self.manifest["kind"] != "reduced":
            raise InputError(f"{folder}/bundle.json: kind is {self.manifest['kind']!r}, expected 'reduced'")
        entry = self.manifest["prior"]
        learned = entry.get("residual") and file_of(folder, self.manifest, entry["residual"])
        self.prior = load_prior(file_of(folder, self.manifest, entry["file"]), learned)
        mesh = load_mesh(file_of(folder, self.manifest, self.manifest["mesh"]["file"]))
        self.lender = Lender(mesh, self.prior.contact_nodes, self.manifest["boundary"])
        options = onnxruntime.SessionOptions()
        options.intra_op_num_threads = 1
        graph = str(folder / "latent.onnx")
        self.session = onnxruntime.InferenceSession(graph, options, providers=["CPUExecutionProvider"])
        self.correct = True
        self.reset()

    def reset(self) -> None:
        """Back to rest."""
        r, rz = self.manifest["reduced"]["modes"], self.manifest["reduced"]["response_modes"]
        self.b = self.b_prev = self.p = np.zeros(r, np.float32)
        self.z = np.zeros(rz, np.float32)
        self.q = np.zeros(self.prior.response.shape[1], np.float32)
        self.limit, self.contact_set = 0.0, np.zeros(0, np.int32)

    def step(self, nodes: np.ndarray, vectors: np.ndarray) -> np.ndarray:
        """One 50 ms step: contact `nodes [m]` with displacements `vectors [m,3]` (mm); returns `u' [K,3]`, mm."""
        manifest, prior = self.manifest["reduced"], self.prior
        forces = prior.forces(*self.lender(nodes, vectors))
        q, z, p = prior.coordinates(forces), prior.z(forces), prior.p(forces)
        flags = np.array([len(nodes) > 0, len(self.contact_set) > 0], np.float32)
        state = np.concatenate([self.b, self.b_prev, z, self.z, p, self.p, flags])[None]
        b = self.session.run(None, {"state": state.astype(np.float32)})[0][0]

        jump = 0.0 if np.array_equal(nodes, self.contact_set) else float(np.linalg.norm(q - self.q))
        bound = manifest["bound"]
        self.limit = max(bound["relative"] * float(np.linalg.norm(q)), bound["decay"] * (self.limit + jump))
        norm = float(np.linalg.norm(b))
        if norm > self.limit:
            b = b * np.float32(self.limit / norm)
        start, end = manifest["fade"]["start_push_mm"], manifest["fade"]["end_push_mm"]
        push = float(np.linalg.norm(vectors, axis=1).max(initial=0.0)) if len(nodes) else 0.0
        b = b * np.float32(min(max((end - push) / (end - start), 0.0), 1.0))
        if not self.correct:
            b = np.zeros_like(b)

        field = prior.field(q + b @ prior.residual)
        free = ~self.lender.held[nodes]
        field[nodes[free]] = vectors[free]
        self.b_prev, self.b, self.z, self.p, self.q, self.contact_set = self.b, b, z, p, q, np.array(nodes)
        return field
