"""Converts a file for `upt make`: KIND INPUT OUTPUT [LABEL ...]. What it prints is told to the user."""

import sys
from pathlib import Path

import numpy as np


def isosurface(field):
    """Triangles where a field on a grid is 0, counter-clockwise from where it is below: each cell as six tetrahedra."""
    field = np.where(np.abs(field) < 1e-6, 1e-6, field)
    shape = np.array(field.shape)
    strides = np.array([shape[1] * shape[2], shape[2], 1])
    cells = np.indices(shape - 1).reshape(3, -1).T @ strides
    values = field.ravel()
    corner = {bits: np.array(bits) @ strides for bits in np.ndindex(2, 2, 2)}
    # Around the diagonal from (0, 0, 0) to (1, 1, 1): along the axes in every order; half of the orders are mirrored.
    tets = []
    for order, even in [((0, 1, 2), 1), ((1, 2, 0), 1), ((2, 0, 1), 1), ((0, 2, 1), 0), ((2, 1, 0), 0), ((1, 0, 2), 0)]:
        one, two = (tuple(int(axis in order[:n]) for axis in range(3)) for n in (1, 2))
        way = [corner[0, 0, 0], corner[one], corner[two], corner[1, 1, 1]]
        tets.append(cells[:, None] + np.array(way if even else [way[0], way[2], way[1], way[3]]))
    tets = np.concatenate(tets)
    inside = values[tets] > 0
    tets, inside = tets[inside.any(1) & ~inside.all(1)], inside[inside.any(1) & ~inside.all(1)]
    triangles = []
    for kind in np.ndindex(2, 2, 2, 2):
        rows = tets[(inside == np.array(kind, bool)).all(1)]
        ins, outs = [i for i in range(4) if kind[i]], [i for i in range(4) if not kind[i]]
        if len(ins) in (1, 3):
            [apex] = ins if len(ins) == 1 else outs
            a, b, c = (i for i in range(4) if i != apex)
            corners = [[(apex, a), (apex, b), (apex, c)]]
        elif len(ins) == 2:
            (a, b), (c, d) = ins, outs
            corners = [[(a, c), (b, c), (b, d)], [(a, c), (b, d), (a, d)]]
        else:
            continue
        # Which way round, by a tetrahedron of the same orientation as all of these.
        unit = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.0]])
        for three in corners:
            p, q, r = (unit[list(edge)].mean(0) for edge in three)
            away = unit[outs].mean(0) - unit[ins].mean(0)
            if np.cross(q - p, r - p) @ away < 0:
                three = three[::-1]
            triangles.append(np.stack([rows[:, list(edge)] for edge in three], 1))
    edges = np.sort(np.concatenate(triangles), axis=2)
    edges, faces = np.unique(edges.reshape(-1, 2), axis=0, return_inverse=True)
    place = values[edges]
    # Not quite at a corner, where triangles would shrink to nothing.
    share = np.clip(place[:, 0] / (place[:, 0] - place[:, 1]), 0.05, 0.95)[:, None]
    ends = [np.stack(np.unravel_index(edges[:, k], shape), 1) for k in (0, 1)]
    return (1 - share) * ends[0] + share * ends[1], faces.reshape(-1, 3)


def nifti(path, out, wanted=()):
    """The surface of the wanted labels (or all) together as a .ply in mm, and one of each label beside it."""
    import nibabel
    from scipy.ndimage import gaussian_filter

    try:
        image = nibabel.load(path)
        labels = np.asarray(image.dataobj)
    except Exception as error:  # the library has no base class for what may be wrong with a file
        sys.exit(f"{error}".splitlines()[0] + ": is the file a NIfTI volume, and whole?")
    # What is nothing in other programs: NaN, and numbers below 0.
    if labels.dtype.kind in "if" and not np.all(labels >= 0):
        print(f"{np.sum(~(labels >= 0))} voxels of negative labels or NaN are background")
        labels = np.where(labels >= 0, labels, 0)
    if labels.ndim != 3 or labels.dtype.kind not in "iuf" or not np.all(labels == np.round(labels)):
        sys.exit("a label volume has three axes and whole numbers")
    names = [int(name) for name in np.unique(labels) if name != 0]
    if not names:
        sys.exit("the volume holds no label but 0")
    if missing := [name for name in wanted if name not in names]:
        sys.exit(f"--label: no voxel has label {missing[0]}; the volume has {', '.join(map(str, names[:40]))}")
    voxel = abs(np.linalg.det(image.affine[:3, :3]))

    def surface(inside, file):
        field = gaussian_filter(np.pad(inside, 3).astype(float), 0.8) - 0.5
        if not np.any(field > 0):
            return False
        points, faces = isosurface(field)
        points = (points - 3) @ image.affine[:3, :3].T + image.affine[:3, 3]
        if np.linalg.det(image.affine[:3, :3]) < 0:
            faces = faces[:, ::-1]
        head = f"ply\nformat ascii 1.0\nelement vertex {len(points)}\n"
        head += "property double x\nproperty double y\nproperty double z\n"
        head += f"element face {len(faces)}\nproperty list uchar int vertex_indices\nend_header\n"
        lines = [" ".join(f"{x:.5f}" for x in point) for point in points]
        lines += [f"3 {a} {b} {c}" for a, b, c in faces]
        file.write_text(head + "\n".join(lines) + "\n")
        return True

    if not surface(np.isin(labels, wanted) if wanted else labels != 0, Path(out)):
        sys.exit("what the volume labels is thinner than two voxels")
    if len(names) > 1:
        for name in names:
            file = Path(out).with_name(f"label-{name}.ply")
            found = labels == name
            place = image.affine[:3, :3] @ np.argwhere(found).mean(0) + image.affine[:3, 3]
            size = f"{np.sum(found) * voxel / 1000:.1f} ml at ({', '.join(f'{x:.0f}' for x in place)}) mm"
            if surface(found, file):
                print(f"label {name}: {size}; alone with --label {name}, stiffer with --stiffness inside:{file}=FACTOR")
            else:
                print(f"label {name}: {size}, too small for a surface")


if __name__ == "__main__":
    kind, path, out, *wanted = sys.argv[1:]
    {"nifti": nifti}[kind](path, out, [int(name) for name in wanted])
