"""A bundle made ready to step."""

from __future__ import annotations

import ctypes
import json
import os
import sys
import weakref
from collections.abc import Callable
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from upt._arrays import Floats, Indices, address, vectors
from upt._library import check, ensure_started, lib, read_text
from upt._native import IndexSet, ModelInfo, ModelOptions
from upt.scene import Scene

if TYPE_CHECKING:
    if sys.version_info >= (3, 12):
        from typing import Unpack
    else:
        from typing_extensions import Unpack

    from upt._native import ModelOptionsKeywords, SceneOptionsKeywords


class Model:
    """A bundle made ready to step. Immutable; any thread may use it.

    Args:
        path: the bundle's folder.
        options: fields of `upt.ModelOptions`, for instance `threads=2`, `providers=["cuda", "cpu"]`.

    Raises:
        upt.BundleError: a file is missing or invalid; the message names it and the field.
        upt.RuntimeLibraryError: ONNX Runtime cannot be loaded, or no provider can run the model.
    """

    def __init__(self, path: str | os.PathLike[str], **options: Unpack[ModelOptionsKeywords]) -> None:
        ensure_started()
        if not isinstance(path, str | os.PathLike):
            raise TypeError(f"path is {path!r}, expected the folder of a bundle: a str or a path")
        handle = ctypes.c_void_p()
        fields = ModelOptions(**options)
        check(lib.upt_model_create(os.fsencode(path), ctypes.byref(fields), ctypes.byref(handle)))
        self._handle = handle.value
        self._close = weakref.finalize(self, lib.upt_model_destroy, handle.value)

    def scene(self, **options: Unpack[SceneOptionsKeywords]) -> Scene:
        """A new scene at rest; options are fields of `upt.SceneOptions`, for instance `kernel="native"`."""
        return Scene(self, **options)

    @cached_property
    def info(self) -> ModelInfo:
        """Sizes, step length, provider, memory: see `upt.ModelInfo`."""
        info = ModelInfo()
        check(lib.upt_model_read_info(self._handle, ctypes.byref(info)))
        return info

    @property
    def node_count(self) -> int:
        """K, the nodes of the bundle's mesh."""
        return self.info.node_count

    @property
    def dt(self) -> float:
        """Length of a step, seconds."""
        return self.info.dt

    @property
    def frame_step_s(self) -> float:
        """`step_s` for a scene that shows frames (`Scene.present`), seconds; `dt` where the bundle says nothing."""
        return self.info.frame_step_s

    def describe(self) -> dict[str, Any]:
        """Name, bundle hash, the provider of each stage and why the others were not chosen."""
        described: dict[str, Any] = json.loads(read_text(lib.upt_model_describe, self._handle))
        return described

    @cached_property
    def positions(self) -> Floats:
        """Rest positions `[K, 3]` float32, mm; read-only."""
        out = np.empty((self.node_count, 3), np.float32)
        check(lib.upt_model_read_positions(self._handle, address(out), out.size))
        out.flags.writeable = False
        return out

    def indices(self, which: IndexSet | int) -> Indices:
        """A static index set as `[n]` uint32: node indices, 3 per face, 4 per tetrahedron."""
        if not isinstance(which, int):
            raise TypeError(f"which is {which!r}, expected an upt.IndexSet")
        needed = ctypes.c_uint64()
        check(lib.upt_model_read_indices(self._handle, which, None, 0, ctypes.byref(needed)))
        out = np.empty(needed.value, np.uint32)
        check(lib.upt_model_read_indices(self._handle, which, address(out), out.size, None))
        return out

    @cached_property
    def supports(self) -> dict[str, Indices]:
        """The bundle's support groups, in order: by name their nodes, `[n]` uint32; `Loads.supports` moves them."""
        return self._named("supports", lib.upt_model_read_support)

    @cached_property
    def regions(self) -> dict[str, Indices]:
        """The named regions of the surface: by name their nodes, `[n]` uint32; `Loads.pressures` takes them."""
        return self._named("regions", lib.upt_model_read_region)

    def locate(self, places: ArrayLike) -> tuple[Indices, Floats]:
        """Points of the mesh at places at rest `[n, 3]`, mm, for `PointForce.nodes` and `PointForce.weights`.

        Of each the tetrahedron that holds it; of one outside of the mesh the closest combination.

        Returns:
            Nodes `[n, 4]` and weights `[n, 4]`.
        """
        given = vectors(places, "places")
        nodes, weights = np.zeros((len(given), 4), np.uint32), np.zeros((len(given), 4), np.float32)
        if len(given):
            check(
                lib.upt_model_locate_points(self._handle, address(given), len(given), address(nodes), address(weights))
            )
        return nodes, weights

    def _named(self, what: str, read: Callable[..., int]) -> dict[str, Indices]:
        found: dict[str, Indices] = {}
        for at, entry in enumerate(self.describe()[what]):
            out = np.empty(entry["nodes"], np.uint32)
            check(read(self._handle, at, None, 0, address(out), out.size, None))
            found[entry["name"]] = out
        return found

    @cached_property
    def surface_nodes(self) -> Indices:
        """Nodes of the surface, `[n]` uint32."""
        return self.indices(IndexSet.SURFACE_NODES)

    @cached_property
    def domain_nodes(self) -> Indices:
        """Nodes that instruments may touch, `[n]` uint32."""
        return self.indices(IndexSet.DOMAIN_NODES)

    @cached_property
    def fixed_nodes(self) -> Indices:
        """Nodes held at zero, `[n]` uint32."""
        return self.indices(IndexSet.FIXED_NODES)

    @cached_property
    def surface_faces(self) -> Indices:
        """Boundary triangles `[n, 3]` uint32, outward."""
        return self.indices(IndexSet.SURFACE_FACES).reshape(-1, 3)

    @cached_property
    def domain_faces(self) -> Indices:
        """Triangles that instruments may touch, `[n, 3]` uint32, outward."""
        return self.indices(IndexSet.DOMAIN_FACES).reshape(-1, 3)

    @cached_property
    def tets(self) -> Indices:
        """Tetrahedra `[n, 4]` uint32, positive volume."""
        return self.indices(IndexSet.TETS).reshape(-1, 4)

    def close(self) -> None:
        """Frees the model; its scenes stay usable. Also done when the object is collected."""
        self._close()

    def __enter__(self) -> Model:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()
