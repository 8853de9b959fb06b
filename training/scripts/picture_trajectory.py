"""Renders frames of a trajectory on its mesh's surface, coloured by displacement.

python training/scripts/picture_trajectory.py MESH TRAJECTORY OUT.png [frames, default 40 80 125 131 140]
"""

import pathlib
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from mpl_toolkits.mplot3d.art3d import Poly3DCollection
from safetensors import safe_open
from safetensors.numpy import load_file


def main():
    mesh = load_file(sys.argv[1])
    with safe_open(sys.argv[2], "np") as file:
        displacement = file.get_tensor("displacement")
        offsets, nodes = file.get_tensor("contact_offsets"), file.get_tensor("contact_nodes")
        metadata = file.metadata()
    frames = [int(value) for value in sys.argv[4:]] or [40, 80, 125, 131, 140]
    surface, rest = mesh["surface"], mesh["positions"].astype(float)
    largest = np.linalg.norm(displacement, axis=2).max()
    # Seen from the side of the site, a little from above and in front.
    side = np.sign(float(metadata["site"].strip("[]").split(",")[0]))
    light = np.array([side * 0.8, 0.35, 0.5])
    light /= np.linalg.norm(light)
    figure = plt.figure(figsize=(4 * len(frames), 4.4))
    for index, frame in enumerate(frames):
        moved = rest + displacement[frame].astype(float)
        corners = moved[surface]
        normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        normals /= np.linalg.norm(normals, axis=1, keepdims=True)
        shade = 0.45 + 0.55 * np.clip(normals @ light, 0, 1)
        amount = np.linalg.norm(displacement[frame], axis=1)[surface].mean(axis=1) / largest
        colors = plt.cm.viridis(amount)
        colors[:, :3] *= shade[:, None]
        axis = figure.add_subplot(1, len(frames), index + 1, projection="3d", computed_zorder=False)
        axis.add_collection3d(Poly3DCollection(corners, facecolors=colors, linewidths=0))
        contact = nodes[offsets[frame] : offsets[frame + 1]]
        outside = moved[contact] + 1.5 * side * np.array([1.0, 0, 0])
        axis.scatter(*outside.T, color="red", s=3, depthshade=False, zorder=10)
        center, half = rest.mean(axis=0), np.ptp(rest, axis=0).max() / 2
        for limits, middle in zip((axis.set_xlim, axis.set_ylim, axis.set_zlim), center, strict=True):
            limits(middle - 0.75 * half, middle + 0.75 * half)
        axis.set_box_aspect((1, 1, 1))
        axis.view_init(elev=20, azim=25 if side > 0 else 155)
        axis.set_axis_off()
        deepest = np.linalg.norm(displacement[frame], axis=1).max()
        axis.set_title(f"t = {frame * float(metadata['dt_s']):.2f} s, largest {deepest:.1f} mm")
    title = f"scheme {metadata['scheme']}, seed {metadata['seed']}, K = {len(rest):,}"
    figure.suptitle(f"{title}, colour 0 to {largest:.1f} mm, red: contact nodes")
    figure.subplots_adjust(left=0, right=1, bottom=0, top=0.86, wspace=0)
    figure.savefig(pathlib.Path(sys.argv[3]), dpi=80)


if __name__ == "__main__":
    main()
