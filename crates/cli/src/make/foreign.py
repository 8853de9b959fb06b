"""Converts a file for `upt make`: KIND INPUT OUTPUT. What it prints is told to the user."""

import sys
from pathlib import Path

import numpy as np


def write_tets(out, points, tets, groups):
    """A .vtu with the tetrahedra, and an array `group` of their part's number."""
    import meshio

    if not len(tets):
        sys.exit("the file holds no linear tetrahedra (C3D4, tet4)")
    data = {"group": [np.asarray(groups, dtype=np.int32)]}
    meshio.Mesh(points, [("tetra", tets)], cell_data=data).write(out, file_format="vtu", binary=False)


def abaqus(path, out):
    import meshio

    mesh = meshio.read(path, file_format="abaqus")
    tets, groups = [], []
    for at, block in enumerate(mesh.cells):
        if block.type != "tetra":
            continue
        group = np.zeros(len(block.data), dtype=np.int32)
        for number, (_, sets) in enumerate(sorted(mesh.cell_sets.items()), 1):
            rows = sets[at] if sets[at] is not None else []
            group[np.asarray(rows, dtype=int)] = number
        tets.append(block.data)
        groups.append(group)
    for number, name in enumerate(sorted(mesh.cell_sets), 1):
        print(f"element set {name} is group:group={number}")
    empty = np.zeros((0, 4), dtype=int)
    write_tets(out, mesh.points, np.concatenate(tets or [empty]), np.concatenate(groups or [[]]))


def febio(path, out):
    from xml.etree import ElementTree

    root = ElementTree.parse(path).getroot()
    body = root.find("Mesh") if root.find("Mesh") is not None else root.find("Geometry")
    if body is None:
        sys.exit("the file has neither <Mesh> nor <Geometry>")
    number_of, points = {}, []
    for nodes in body.findall("Nodes"):
        for node in nodes.findall("node"):
            number_of[node.get("id")] = len(points)
            points.append([float(x) for x in node.text.split(",")])
    tets, groups = [], []
    for group, elements in enumerate(body.findall("Elements"), 1):
        if elements.get("type", "").lower() != "tet4":
            continue
        print(f"part {elements.get('name') or elements.get('mat') or group} is group:group={group}")
        for element in elements.findall("elem"):
            tets.append([number_of[name.strip()] for name in element.text.split(",")])
            groups.append(group)
    write_tets(out, np.array(points), np.array(tets), groups)


def nifti(path, out):
    """The surface of all labels together as a .ply in mm, and one of each label beside it."""
    import nibabel
    from skimage.filters import gaussian
    from skimage.measure import label, marching_cubes

    image = nibabel.load(path)
    labels = np.asarray(image.dataobj)
    if labels.ndim != 3 or not np.all(labels == np.round(labels)):
        sys.exit("a label volume has three axes and whole numbers")
    names = [int(name) for name in np.unique(labels) if name != 0]
    if not names:
        sys.exit("the volume holds no label but 0")

    def surface(inside, file):
        parts = label(inside)
        inside = parts == 1 + np.argmax(np.bincount(parts.ravel())[1:])
        field = gaussian(np.pad(inside, 2).astype(float), 0.8)
        points, faces, _, _ = marching_cubes(field, 0.5)
        points = (points - 2) @ image.affine[:3, :3].T + image.affine[:3, 3]
        if np.linalg.det(image.affine[:3, :3]) > 0:
            faces = faces[:, ::-1]
        head = f"ply\nformat ascii 1.0\nelement vertex {len(points)}\n"
        head += "property double x\nproperty double y\nproperty double z\n"
        head += f"element face {len(faces)}\nproperty list uchar int vertex_indices\nend_header\n"
        lines = [" ".join(f"{x:.5f}" for x in point) for point in points]
        lines += [f"3 {a} {b} {c}" for a, b, c in faces]
        file.write_text(head + "\n".join(lines) + "\n")

    surface(labels != 0, Path(out))
    if len(names) > 1:
        for name in names:
            file = Path(out).with_name(f"label-{name}.ply")
            surface(labels == name, file)
            print(f"label {name}: {np.sum(labels == name)} voxels; --stiffness inside:{file}=FACTOR")


if __name__ == "__main__":
    kind, path, out = sys.argv[1:]
    {"inp": abaqus, "feb": febio, "nifti": nifti}[kind](path, out)
