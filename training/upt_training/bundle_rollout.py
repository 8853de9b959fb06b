"""Runs a bundle of kind `upt` autoregressively through ONNX Runtime, as the runtime library does: the check of both.

Features, base and boundary conditions as bundle.json says; the state starts at rest; held nodes 0, contact nodes `c`.
"""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
from safetensors.numpy import load_file

from upt_training.anchors import Anchors
from upt_training.bundle import BundleSession
from upt_training.bundle_folder import file_of
from upt_training.config import FEATURE_WIDTH, GraphSettings
from upt_training.errors import InputError
from upt_training.graph import build_graph
from upt_training.lend import Lender
from upt_training.mesh_file import Mesh, load_mesh
from upt_training.prior_table import PriorTable


class BundleRunner:
    """One bundle on one mesh; `step` advances the state and returns `u [K, 3]` mm."""

    def __init__(
        self,
        folder: Path,
        mesh: Mesh | None = None,
        prior: Path | None = None,
        precision: str = "f32",
        vibration: Path | None = None,
    ):
        folder = Path(folder)
        path = folder / "bundle.json"
        if not path.exists():
            raise InputError(f"{path}: no such file; export a run with `python -m upt_training export`")
        self.manifest = json.loads(path.read_text())
        if self.manifest.get("kind") != "upt":
            raise InputError(f"{path}: kind is {self.manifest.get('kind')!r}; this command runs bundles of kind 'upt'")
        if precision not in self.manifest["precisions"]:
            raise InputError(f"{path}: precision {precision!r} is not in this bundle; export with --{precision}")
        self.settings = self.manifest["upt"]
        self.mesh = mesh or load_mesh(file_of(folder, self.manifest, "mesh.safetensors"))
        self.graph = build_graph(self.mesh, GraphSettings(**self.settings["graph"]))
        suffix = "" if precision == "f32" else f".{precision}"
        self.session = BundleSession(folder, self.mesh, self.graph, suffix)
        own_mesh = self.mesh.sha256 == self.manifest["mesh"]["mesh_sha256"]
        file = self.settings.get("anchors") if own_mesh else None
        self.anchors = Anchors(**load_file(file_of(folder, self.manifest, file))) if file else None
        self.prior, self.lender = None, None
        if "prior" in self.manifest:
            if prior is None and mesh is not None and mesh.sha256 != self.manifest["mesh"]["mesh_sha256"]:
                raise InputError(f"{path}: the bundle uses a prior; pass --prior with the prior of the other mesh")
            swings = self.manifest["prior"].get("vibration")
            if swings and prior is not None and vibration is None:
                raise InputError(f"{path}: the bundle uses free vibration; pass --vibration with the tables of {prior}")
            table = PriorTable(
                prior or file_of(folder, self.manifest, self.manifest["prior"]["file"]),
                self.mesh.node_count,
                (vibration or file_of(folder, self.manifest, swings)) if swings else None,
                self.manifest["material"]["damping_per_s"],
                self.manifest["dt_s"],
            )
            self.prior = table.sequence()
            self.lender = Lender(self.mesh, np.flatnonzero(table.row >= 0), self.manifest["boundary"])
        self.mean = np.asarray(self.settings["normalisation"]["mean"], np.float32)
        self.std = np.asarray(self.settings["normalisation"]["std"], np.float32)
        self.held = self.mesh.held_nodes(self.manifest["boundary"])
        self.reset()

    def reset(self) -> None:
        zero = np.zeros((self.mesh.node_count, 3), np.float32)
        self.u, self.previous, self.prior_now = zero, zero, zero
        if self.prior is not None:
            self.prior.reset()

    def features(self, nodes: np.ndarray, vectors: np.ndarray, prior_next: np.ndarray) -> np.ndarray:
        """Normalised features `[K, f]` of the step that ends with this contact."""
        collision, contact = np.zeros_like(self.u), np.zeros((len(self.u), 1), np.float32)
        collision[nodes], contact[nodes] = vectors, 1.0
        fields = {
            "displacement": self.u,
            "collision": collision,
            "previous_displacement": self.previous,
            "prior": prior_next,
            "previous_prior": self.prior_now,
            "contact": contact,
        }
        parts = [
            fields[name] if FEATURE_WIDTH[name] == 1 else (fields[name] - self.mean) / self.std
            for name in self.settings["features"]
        ]
        return np.ascontiguousarray(np.concatenate(parts, axis=1), np.float32)

    def network(self, features: np.ndarray) -> np.ndarray:
        """Normalised features `[K, f]` -> what is added to the base `[K, 3]`, mm."""
        if self.anchors is None:
            return self.session(features)
        at_anchors = self.session.decode(*self.session.keys_values(features), self.anchors.nodes)
        return self.anchors.interpolate(at_anchors)

    def step(self, nodes: np.ndarray, vectors: np.ndarray) -> np.ndarray:
        prior_next = np.zeros_like(self.u) if self.prior is None else self.prior.step(*self.lender(nodes, vectors))
        out = self.network(self.features(nodes, vectors, prior_next))
        if self.settings["base"] == "displacement":
            out = out + self.u
        elif self.settings["base"] == "prior":
            out = out + prior_next
        out[self.held] = 0.0
        out[nodes] = vectors
        self.previous, self.u, self.prior_now = self.u, out, prior_next
        return out
