"""Signed distance of a hemisphere on 1 mm voxels, from its closed pial surface.

Inside voxels by ray parity along x, sulci closed by a ball of 4 mm (there is no self-contact
in the solver, so opposite banks must not be separate surfaces), exact Euclidean distance on the
voxels, then a light Gaussian blur that removes the staircase.

Values are positive inside, mm. Grids are `[nx, ny, nz]`, sample `[0, 0, 0]` at `origin`.
"""

from dataclasses import dataclass

import numpy as np
from scipy import ndimage

VOXEL = 1.0
CLOSING = 4.0
BLUR = 0.8
MARGIN = 10


@dataclass
class Grid:
    """Signed distance `values` `[nx, ny, nz]` f32, mm, at `origin + VOXEL * index`."""

    origin: np.ndarray
    values: np.ndarray

    def coordinates(self):
        """Sample coordinates along each axis, mm: three 1-D arrays."""
        return [self.origin[axis] + VOXEL * np.arange(self.values.shape[axis]) for axis in range(3)]


def inside_mask(vertices, faces, origin, shape):
    """Which samples lie inside the closed surface (`vertices` `[V, 3]` mm, `faces` `[F, 3]`).

    A sample is inside where a ray towards -x crosses the surface an odd number of times. Rays
    are moved off the grid by an irrational part of a voxel, so that none meets an edge exactly.
    """
    corners = vertices[faces].astype(np.float64)
    y0 = origin[1] + VOXEL * np.sqrt(2.0) * 1e-4
    z0 = origin[2] + VOXEL * np.sqrt(3.0) * 1e-4
    crossings = np.zeros(shape, dtype=np.int32)
    for a, b, c in corners:
        low = np.minimum(np.minimum(a, b), c)
        high = np.maximum(np.maximum(a, b), c)
        rows = np.arange(max(int(np.ceil(low[1] - y0)), 0), min(int(np.floor(high[1] - y0)), shape[1] - 1) + 1)
        columns = np.arange(max(int(np.ceil(low[2] - z0)), 0), min(int(np.floor(high[2] - z0)), shape[2] - 1) + 1)
        if not len(rows) or not len(columns):
            continue
        y, z = np.meshgrid(y0 + rows, z0 + columns, indexing="ij")
        area = (b[1] - a[1]) * (c[2] - a[2]) - (c[1] - a[1]) * (b[2] - a[2])
        if area == 0.0:
            continue
        u = ((y - a[1]) * (c[2] - a[2]) - (c[1] - a[1]) * (z - a[2])) / area
        v = ((b[1] - a[1]) * (z - a[2]) - (y - a[1]) * (b[2] - a[2])) / area
        hit = (u >= 0) & (v >= 0) & (u + v <= 1)
        x = a[0] + u * (b[0] - a[0]) + v * (c[0] - a[0])
        first = np.ceil(x - origin[0]).astype(int)
        i, j = np.nonzero(hit)
        np.add.at(crossings, (np.clip(first[i, j], 0, shape[0] - 1), rows[i], columns[j]), 1)
    return np.cumsum(crossings, axis=0) % 2 == 1


def signed_distance(mask):
    """Signed Euclidean distance to the border between the voxels of `mask` and the rest, mm."""
    inner = ndimage.distance_transform_edt(mask)
    outer = ndimage.distance_transform_edt(~mask)
    return np.where(mask, inner - 0.5, 0.5 - outer) * VOXEL


def close(mask, radius):
    """Closing by a ball: dilate, then erode, both by exact distance."""
    dilated = ndimage.distance_transform_edt(~mask) <= radius
    return (ndimage.distance_transform_edt(dilated) > radius) | mask


def largest(mask):
    """The largest face-connected part of `mask`."""
    labels, count = ndimage.label(mask)
    if count < 2:
        return mask
    sizes = np.bincount(labels.ravel())
    sizes[0] = 0
    return labels == sizes.argmax()


def hemisphere_distance(vertices, faces, origin, shape):
    """Signed distance of one hemisphere, closed and blurred. Returns a `Grid`."""
    mask = close(inside_mask(vertices, faces, origin, shape), CLOSING)
    mask = ~largest(~largest(mask))
    values = ndimage.gaussian_filter(signed_distance(mask), BLUR, truncate=4.0)
    return Grid(origin, values.astype(np.float32))


def grid_box(vertices):
    """Origin (whole mm) and shape of a grid that holds `vertices` with a margin."""
    low = np.floor(vertices.min(axis=0)) - MARGIN
    high = np.ceil(vertices.max(axis=0)) + MARGIN
    return low.astype(np.float64), tuple((high - low).astype(int) + 1)
