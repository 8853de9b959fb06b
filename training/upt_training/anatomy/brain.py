"""The brain: two stuffed hemispheres, welded at the corpus callosum, with its node and face sets.

Each hemisphere is stuffed on its own side of the plane x = 0, which is a plane of the lattice, so
that the two midplane faces have the same nodes. Those are kept double (the hemispheres part there)
but in a tube around the callosal arc, where they become one.

Sets:

* `fixed`: nodes within the tube's radius of the callosal arc, and every welded node, so that the
  held tissue parts the hemispheres.
* `domain`: boundary faces whose centroid is within 25 mm of the Sylvian polyline and whose outward
  normal is lateral (its -x part above 0.25); the largest part joined by edges.
* `supported`: boundary nodes that the skull would hold: within 5 mm under the brain's outer
  envelope (both hemispheres closed by a ball of 20 mm), more than 10 mm from every node of
  `domain`, and not in `fixed`. The open window is thus the domain and 10 mm around it, about 70 mm
  across the fissure. Sulcal depths, the walls of the interhemispheric fissure and the face where
  the brain stem was are under the envelope by more than that and stay free.
"""

from dataclasses import dataclass

import numpy as np
from scipy import ndimage
from scipy.spatial import cKDTree

from . import tetrahedra
from .distance import VOXEL, Grid, close, grid_box, hemisphere_distance
from .landmarks import (
    CALLOSUM_RADIUS,
    SYLVIAN,
    SYLVIAN_RADIUS,
    distance_to_callosum,
    distance_to_polyline,
)
from .stuffing import stuff

LATERAL = 0.25
WINDOW_MARGIN = 10.0
ENVELOPE_CLOSING = 20.0
ENVELOPE_DEPTH = 5.0


@dataclass
class Brain:
    """A brain mesh: arrays as in docs/reference/formats.md, positions in f64."""

    positions: np.ndarray
    tets: np.ndarray
    surface: np.ndarray
    domain: np.ndarray
    fixed: np.ndarray
    supported: np.ndarray
    spacing: float


def pial_surfaces():
    """fsaverage5's pial surfaces from nilearn's package data: `{side: (vertices, faces)}`."""
    import nibabel
    from nilearn import datasets

    files = datasets.fetch_surf_fsaverage("fsaverage5")
    surfaces = {}
    for side in ("left", "right"):
        arrays = nibabel.load(files[f"pial_{side}"]).darrays
        surfaces[side] = (arrays[0].data.astype(np.float64), arrays[1].data.astype(np.int64))
    return surfaces


class Anatomy:
    """The distance fields, computed once for any number of resolutions."""

    def __init__(self):
        surfaces = pial_surfaces()
        box = grid_box(np.concatenate([vertices for vertices, _ in surfaces.values()]))
        self.grids = {side: hemisphere_distance(vertices, faces, *box) for side, (vertices, faces) in surfaces.items()}
        whole = (self.grids["left"].values > 0) | (self.grids["right"].values > 0)
        envelope = close(np.pad(whole, 20), ENVELOPE_CLOSING)
        depth = ndimage.distance_transform_edt(envelope) * VOXEL
        self.depth = Grid(box[0] - 20 * VOXEL, depth.astype(np.float32))

    def hemispheres(self, spacing):
        """Stuffed left and right hemisphere with the callosal tube added: `[(positions, tets)]`."""
        radius = callosum_radius(spacing)
        out = []
        for side, sign in (("left", -1.0), ("right", 1.0)):
            grid = self.grids[side]
            points = np.stack(np.meshgrid(*grid.coordinates(), indexing="ij"), axis=-1)
            tube = radius - distance_to_callosum(points.reshape(-1, 3))
            values = np.maximum(grid.values, tube.reshape(grid.values.shape))
            out.append(stuff(Grid(grid.origin, values.astype(np.float32)), spacing, sign))
        return out

    def build(self, spacing):
        """The brain at a lattice spacing, mm."""
        radius = callosum_radius(spacing)
        positions, tets, welded = weld(*self.hemispheres(spacing), radius)
        positions, tets, welded = order(positions, tets, welded, spacing)
        surface = tetrahedra.boundary(tets)
        fixed = np.flatnonzero(welded | (distance_to_callosum(positions) <= radius))
        domain = sylvian_faces(positions, surface)
        near, _ = cKDTree(positions[np.unique(surface[domain])]).query(positions)
        rim = np.zeros(len(positions), dtype=bool)
        rim[surface] = True
        index = (positions - self.depth.origin).T / VOXEL
        depth = ndimage.map_coordinates(self.depth.values, index, order=1)
        held = rim & (near > WINDOW_MARGIN) & (depth <= ENVELOPE_DEPTH)
        held[fixed] = False
        return Brain(positions, tets, surface, domain, fixed, np.flatnonzero(held), spacing)


def callosum_radius(spacing):
    """Radius of the callosal tube, mm: 4.5, or three quarters of a coarser lattice's spacing, so
    that the tube always holds a band of lattice nodes."""
    return max(CALLOSUM_RADIUS, 0.75 * spacing)


def weld(left, right, radius):
    """Joins two hemispheres in the midplane triangles within `radius` of the callosal arc.

    Returns positions `[K, 3]`, tetrahedra `[T, 4]` and which nodes are shared `[K]`.
    """
    triangles = []
    for positions, tets in (left, right):
        faces = np.sort(tetrahedra.boundary(tets), axis=1)
        triangles.append(faces[np.all(positions[faces][:, :, 0] == 0.0, axis=1)])
    keys = {}
    for node in np.unique(triangles[0]):
        keys[tuple(left[0][node])] = node
    partner = {node: keys.get(tuple(right[0][node])) for node in np.unique(triangles[1])}
    in_left = {tuple(face) for face in triangles[0]}
    common = []
    for face in triangles[1]:
        mates = [partner[node] for node in face]
        if None not in mates and tuple(sorted(mates)) in in_left:
            common.append(face)
    common = np.array(common)
    centroids = right[0][common].mean(axis=1)
    patch = np.zeros(len(common), dtype=bool)
    inner = np.flatnonzero(distance_to_callosum(centroids) <= radius)
    if not len(inner):
        raise ValueError(
            f"no midplane triangle lies within {radius} mm of the callosal arc; use a smaller lattice spacing"
        )
    patch[inner[tetrahedra.largest_part(common[inner])]] = True
    patch = fill_patch(common, patch)

    to_left = {node: partner[node] for node in np.unique(common[patch])}
    renumber = np.full(len(right[0]), -1)
    for node, mate in to_left.items():
        renumber[node] = mate
    free = renumber < 0
    renumber[free] = len(left[0]) + np.arange(free.sum())
    positions = np.concatenate([left[0], right[0][free]])
    welded = np.zeros(len(positions), dtype=bool)
    welded[list(to_left.values())] = True
    return positions, np.concatenate([left[1], renumber[right[1]]]), welded


def fill_patch(triangles, patch):
    """Adds triangles until no edge has both ends but neither of its triangles in the patch, which
    would weld the edge of four faces."""
    edges = tetrahedra.edges_of(triangles)
    _, edge = np.unique(edges, axis=0, return_inverse=True)
    edge = edge.reshape(-1, 3)
    while True:
        nodes = np.zeros(triangles.max() + 1, dtype=bool)
        nodes[triangles[patch]] = True
        welded = np.zeros(edge.max() + 1, dtype=bool)
        welded[edge[patch]] = True
        ends = nodes[edges].all(axis=1).reshape(-1, 3)
        more = ~patch & (ends & ~welded[edge]).any(axis=1)
        if not more.any():
            return patch
        patch |= more


def order(positions, tets, welded, spacing):
    """Renumbers nodes along a Morton curve of cells of half the spacing, and tetrahedra by their
    smallest node, so that neighbours are near in memory."""
    cell = np.floor((positions - positions.min(axis=0)) / (0.5 * spacing)).astype(np.uint64)
    code = np.zeros(len(positions), dtype=np.uint64)
    for bit in range(10):
        for axis in range(3):
            one = (cell[:, axis] >> np.uint64(bit)) & np.uint64(1)
            code |= one << np.uint64(3 * bit + axis)
    rank = np.argsort(code, kind="stable")
    renumber = np.empty(len(rank), dtype=np.int64)
    renumber[rank] = np.arange(len(rank))
    tets = renumber[tets]
    ascending = np.sort(tets, axis=1)
    keys = tuple(ascending[:, i] for i in (3, 2, 1, 0))
    return positions[rank], tets[np.lexsort(keys)], welded[rank]


def sylvian_faces(positions, surface):
    """Rows of `surface` around the left Sylvian fissure, ascending."""
    a, b, c = (positions[surface[:, i]] for i in range(3))
    normal = np.cross(b - a, c - a)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    near = distance_to_polyline((a + b + c) / 3.0, SYLVIAN) <= SYLVIAN_RADIUS
    rows = np.flatnonzero(near & (normal[:, 0] < -LATERAL))
    return rows[tetrahedra.largest_part(surface[rows])]
