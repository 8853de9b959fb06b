"""`python -m upt_training.anatomy.render MESH PICTURE`: the mesh's surface with its sets coloured.

Views from the left, the front, below and of the midplane (left hemisphere cut away).
"""

import argparse
import json

import numpy as np
import pyvista
from safetensors import safe_open

COLOURS = {"free": "#d9b3a6", "supported": "#9aa5b1", "domain": "#3f8f5f", "fixed": "#c0392b"}


def read(path):
    """Tensors and metadata of a mesh file."""
    with safe_open(path, framework="numpy") as file:
        return {key: file.get_tensor(key) for key in file.keys()}, file.metadata()


def coloured(mesh):
    """One `PolyData` a set, each with the faces that belong to it."""
    faces = mesh["surface"]
    kind = np.full(len(faces), "free", dtype=object)
    for name in ("supported", "fixed"):
        kind[np.isin(faces, mesh[name]).all(axis=1)] = name
    kind[mesh["domain"]] = "domain"
    parts = {}
    for name in COLOURS:
        chosen = faces[kind == name]
        if len(chosen):
            cells = np.column_stack([np.full(len(chosen), 3), chosen]).ravel()
            parts[name] = pyvista.PolyData(mesh["positions"], cells)
    return parts


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("mesh")
    parser.add_argument("picture")
    arguments = parser.parse_args()
    mesh, metadata = read(arguments.mesh)
    parts = coloured(mesh)
    plotter = pyvista.Plotter(off_screen=True, shape=(2, 2), window_size=(1500, 1100))
    views = [
        ("left", (-1, 0, 0), (0, 0, 1), None),
        ("front", (0, 1, 0), (0, 0, 1), None),
        ("below", (0, 0, -1), (0, 1, 0), None),
        ("midplane of the right hemisphere", (-1, 0, 0), (0, 0, 1), -1e-3),
    ]
    for index, (title, eye, up, cut) in enumerate(views):
        plotter.subplot(index // 2, index % 2)
        for name, part in parts.items():
            if cut is not None:
                centre = part.cell_centers().points[:, 0]
                part = part.extract_cells(np.flatnonzero(centre > cut))
                if part.n_cells == 0:
                    continue
            plotter.add_mesh(part, color=COLOURS[name], show_edges=True, edge_color="#404040", line_width=0.3)
        plotter.add_text(title, font_size=9)
        if index == 0:
            legend = [[name, COLOURS[name]] for name in parts]
            plotter.add_legend(legend, bcolor="white", size=(0.2, 0.2), face="rectangle")
        plotter.view_vector(eye, up)
        plotter.camera.zoom(1.3)
    plotter.screenshot(arguments.picture)
    print(json.dumps({"name": metadata["name"], "picture": arguments.picture}))


if __name__ == "__main__":
    main()
