"""A case: a body, tools along their poses, and what the reference solver says; the scores of a method on it.

Arrays are those of `upt simulate --tool` (docs/reference/formats.md): mm, mN, s, g. Every method gets the same nodes,
tetrahedra, held nodes, material and poses, and gives back displacements `[F, K, 3]` mm at the ends of the frames, row 0
at rest.
"""

from __future__ import annotations

import json
import struct
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

DTYPES = {"F32": "<f4", "I32": "<i4", "F16": "<f2"}
FRAME_S = 0.05
YOUNG_PA, POISSON, DENSITY, DAMPING = 3000.0, 0.49, 1000.0, 20.0
FACES = [(1, 2, 3), (0, 3, 2), (0, 1, 3), (0, 2, 1)]


def tensors(path: Path) -> tuple[dict[str, np.ndarray], dict[str, str]]:
    """The arrays and the metadata of a safetensors file."""
    data = path.read_bytes()
    (size,) = struct.unpack_from("<Q", data)
    header = json.loads(data[8 : 8 + size])
    meta = header.pop("__metadata__", {})
    found = {}
    for name, entry in header.items():
        begin, end = (8 + size + offset for offset in entry["data_offsets"])
        found[name] = np.frombuffer(data[begin:end], DTYPES[entry["dtype"]]).reshape(entry["shape"])
    return found, meta


@dataclass
class Tool:
    """A capsule along its y axis: radius and half of its straight part in mm, `poses [F, 7]` (mm, quaternion xyzw)."""

    radius: float
    half_length: float
    friction: float
    poses: np.ndarray

    def pose(self, frame: int, part: float) -> tuple[np.ndarray, np.ndarray]:
        """Position and quaternion `part` of the way from the end of `frame - 1` to the end of `frame`."""
        a, b = self.poses[frame - 1], self.poses[frame]
        q = b[3:] if part >= 1 else (1 - part) * a[3:] * np.sign(a[3:] @ b[3:] or 1.0) + part * b[3:]
        return (1 - part) * a[:3] + part * b[:3], q / np.linalg.norm(q)


@dataclass
class Case:
    name: str
    path: Path
    positions: np.ndarray  # [K, 3] f64 mm
    tets: np.ndarray  # [T, 4]
    surface: np.ndarray  # [S, 3]
    domain: np.ndarray  # faces of the surface that tools may touch
    held: np.ndarray  # nodes
    tools: list[Tool]
    truth: np.ndarray  # [F, K, 3] f32 mm
    force: np.ndarray  # [F, n, 3] mN, of the tissue on the tool

    @property
    def frames(self) -> int:
        return len(self.truth)

    def masses(self) -> np.ndarray:
        """Lumped masses `[K]`, kg."""
        e = np.moveaxis(self.positions[self.tets[:, 1:]] - self.positions[self.tets[:, :1]], 1, 2)
        volumes = np.abs(np.linalg.det(e)) / 6.0
        return np.bincount(self.tets.ravel(), np.repeat(volumes, 4), len(self.positions)) * 1e-9 * DENSITY / 4.0


def load(path: Path, mesh_path: Path) -> Case:
    mesh, _ = tensors(mesh_path)
    case, meta = tensors(path)
    tools = []
    for index, tool in enumerate(json.loads(meta["tools"])):
        shape = tool["shape"]
        if shape["kind"] != "capsule":
            raise SystemExit(
                f"{path}: tool {index} is a {shape['kind']}; peers have capsules in common: choose another seed"
            )
        poses = case["tool_poses"][:, index].astype(float)
        tools.append(Tool(shape["radius"], shape["half_length"], tool["friction"], poses))
    return Case(
        path.name.split(".")[0],
        path,
        mesh["positions"].astype(float),
        mesh["tets"],
        mesh["surface"],
        mesh["domain"],
        mesh["fixed"],
        tools,
        case["displacement"].astype(np.float32),
        case["tool_wrenches"][:, :, :3].astype(float),
    )


@dataclass
class Run:
    """What a method gave. `force [F, n, 3]` mN or None; `processor` and `wall [F]` s a frame, 0 at rest."""

    displacement: np.ndarray
    force: np.ndarray | None
    processor: np.ndarray
    wall: np.ndarray
    set_up_s: float
    note: str = ""
    versions: dict[str, str] = field(default_factory=dict)


def samples(case: Case, spacing_mm: float = 2.0) -> tuple[np.ndarray, np.ndarray]:
    """Faces `[M, 3]` and weights `[M, 3]` of points on the domain no farther apart than the spacing."""
    faces, weights = [], []
    for face in case.surface[case.domain]:
        corners = case.positions[face]
        edge = max(np.linalg.norm(corners[i] - corners[i - 1]) for i in range(3))
        n = max(1, int(np.ceil(edge / spacing_mm)))
        for i in range(n + 1):
            for j in range(n + 1 - i):
                faces.append(face)
                weights.append((i / n, j / n, (n - i - j) / n))
    return np.array(faces), np.array(weights)


def scores(case: Case, run: Run) -> dict[str, float | None]:
    """Errors over all frames that the run has, but for the first: mm², mm; force relative to its largest value."""
    frames = len(run.displacement)
    u, truth = run.displacement, case.truth[:frames]
    if not np.isfinite(u).all():
        return {"frames": frames, "mse_mm2": None}
    error = ((u - truth).astype(float) ** 2).sum(2)
    faces, weights = samples(case)
    deepest, smallest = 0.0, 1.0
    for f in range(1, frames):
        x = case.positions + u[f]
        points = np.einsum("mk,mkd->md", weights, x[faces])
        for tool in case.tools:
            place, q = tool.pose(f, 1.0)
            axis = rotated(q, np.array([0.0, 1.0, 0.0]))
            along = np.clip((points - place) @ axis, -tool.half_length, tool.half_length)
            distance = np.linalg.norm(points - place - along[:, None] * axis, axis=1)
            deepest = max(deepest, float((tool.radius - distance).max()))
        e = x[case.tets[:, 1:]] - x[case.tets[:, :1]]
        rest = case.positions[case.tets[:, 1:]] - case.positions[case.tets[:, :1]]
        smallest = min(smallest, float((np.linalg.det(e) / np.linalg.det(rest)).min()))
    out = {
        "frames": frames,
        "mse_mm2": float(error[1:].mean()),
        "rest_mse_mm2": float((truth[1:].astype(float) ** 2).sum(2).mean()),
        "largest_mm": float(np.sqrt(error.max())),
        "penetration_mm": deepest,
        "smallest_det": smallest,
        "force_error": None,
    }
    if run.force is not None:
        norms = np.linalg.norm(case.force[:frames], axis=2)
        apart = np.linalg.norm(run.force - case.force[:frames], axis=2)
        touching = norms > 0.05 * norms.max()
        out["force_error"] = float((apart[touching] / norms[touching]).mean()) if touching.any() else None
    return out


def rotated(q: np.ndarray, v: np.ndarray) -> np.ndarray:
    """`v` turned by the unit quaternion x, y, z, w."""
    t = 2.0 * np.cross(q[:3], v)
    return v + q[3] * t + np.cross(q[:3], t)
