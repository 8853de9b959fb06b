"""Where things are on the fsaverage brain: polylines in surface coordinates (RAS, mm)."""

import numpy as np

# The corpus callosum in the midplane, rostrum to splenium: (y, z).
CALLOSUM = np.array(
    [
        (24, -6),
        (30, 2),
        (29, 10),
        (22, 17),
        (10, 22),
        (-4, 25),
        (-18, 25.5),
        (-30, 22),
        (-37, 15),
        (-38, 8),
    ],
    dtype=np.float64,
)
CALLOSUM_RADIUS = 4.5

# The left Sylvian fissure on the lateral surface, front to back: (x, y, z).
SYLVIAN = np.array([(-44, 22, -14), (-54, 2, -2), (-60, -20, 10), (-60, -42, 22)], dtype=np.float64)
SYLVIAN_RADIUS = 25.0


def distance_to_polyline(points, line):
    """Distance of each of `points` `[n, d]` to the polyline `line` `[m, d]`. Returns `[n]`."""
    best = np.full(len(points), np.inf)
    for a, b in zip(line[:-1], line[1:], strict=True):
        along = b - a
        t = np.clip((points - a) @ along / (along @ along), 0.0, 1.0)
        best = np.minimum(best, np.linalg.norm(points - (a + t[:, None] * along), axis=1))
    return best


def distance_to_callosum(points):
    """Distance of `points` `[n, 3]` to the callosal arc in the plane x = 0, mm. Returns `[n]`."""
    line = np.column_stack([np.zeros(len(CALLOSUM)), CALLOSUM])
    return distance_to_polyline(points, line)
