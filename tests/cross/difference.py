"""difference.py HERE THERE TOLERANCE: the largest difference of two rollouts (raw float32) or trajectories, mm."""

import array
import json
import math
import struct
import sys


def floats(path: str) -> array.array:
    with open(path, "rb") as file:
        data = file.read()
    (length,) = struct.unpack("<Q", data[:8])
    if length < len(data) and data[8:9] == b"{":  # a trajectory: its displacements
        begin, end = json.loads(data[8 : 8 + length])["displacement"]["data_offsets"]
        data = data[8 + length + begin : 8 + length + end]
    return array.array("f", data)


here, there = floats(sys.argv[1]), floats(sys.argv[2])
tolerance = float(sys.argv[3])
if len(here) != len(there) or not here:
    sys.exit(f"{len(here)} floats here, {len(there)} there")
largest = max(abs(a - b) for a, b in zip(here, there, strict=True))
size = max(map(abs, here))
print(f"  largest difference {largest:.2e} mm, of displacements up to {size:.1f} mm; tolerance {tolerance:g} mm")
sys.exit(0 if largest <= tolerance and math.isfinite(largest) else 1)
