"""Connectivity and quality of tetrahedra: boundary, manifoldness, angles, inscribed radii."""

import numpy as np
from scipy import sparse
from scipy.sparse import csgraph

# Faces opposite each corner, outward for a tetrahedron of positive volume.
FACES = np.array([[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]])


def volumes(positions, tets):
    """Signed volumes `[T]`."""
    a, b, c, d = (positions[tets[:, i]] for i in range(4))
    return np.einsum("ij,ij->i", b - a, np.cross(c - a, d - a)) / 6.0


def boundary(tets):
    """Outward boundary triangles `[F, 3]`, in order of tetrahedron and face."""
    faces = tets[:, FACES].reshape(-1, 3)
    _, first, counts = np.unique(np.sort(faces, axis=1), axis=0, return_index=True, return_counts=True)
    return faces[np.sort(first[counts == 1])]


def edges_of(faces):
    """Sorted edges `[3 F, 2]` of triangles `[F, 3]`, face by face."""
    return np.sort(faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)


def non_manifold_edges(surface):
    """Boundary edges `[n, 2]` that do not have exactly two faces."""
    edges, counts = np.unique(edges_of(surface), axis=0, return_counts=True)
    return edges[counts != 2]


def non_manifold_nodes(surface):
    """Boundary nodes whose faces form more than one fan."""
    corner = np.arange(surface.size).reshape(-1, 3)
    # Corners of one node are joined where their faces share an edge at that node.
    spokes, ends = [], []
    for i in range(3):
        for j in (1, 2):
            spokes.append(np.column_stack([surface[:, i], surface[:, (i + j) % 3]]))
            ends.append(corner[:, i])
    spokes, ends = np.concatenate(spokes), np.concatenate(ends)
    order = np.lexsort((spokes[:, 1], spokes[:, 0]))
    spokes, ends = spokes[order], ends[order]
    same = np.all(spokes[1:] == spokes[:-1], axis=1)
    graph = sparse.coo_matrix((np.ones(same.sum()), (ends[:-1][same], ends[1:][same])), shape=(surface.size,) * 2)
    _, labels = csgraph.connected_components(graph, directed=False)
    pairs = np.unique(np.column_stack([surface.ravel(), labels[corner.ravel()]]), axis=0)
    nodes, fans = np.unique(pairs[:, 0], return_counts=True)
    return nodes[fans > 1]


def components(node_count, elements):
    """Number of parts of the graph in which the nodes of each element are joined."""
    first = np.repeat(elements[:, 0], elements.shape[1] - 1)
    graph = sparse.coo_matrix((np.ones(len(first)), (first, elements[:, 1:].ravel())), shape=(node_count, node_count))
    return csgraph.connected_components(graph, directed=False)[0]


def largest_part(faces):
    """Indices of the faces of the largest edge-connected part of triangles `[F, 3]`."""
    edges = edges_of(faces)
    _, edge = np.unique(edges, axis=0, return_inverse=True)
    owner = np.repeat(np.arange(len(faces)), 3)
    order = np.argsort(edge.ravel(), kind="stable")
    edge, owner = edge.ravel()[order], owner[order]
    same = edge[1:] == edge[:-1]
    graph = sparse.coo_matrix((np.ones(same.sum()), (owner[:-1][same], owner[1:][same])), shape=(len(faces),) * 2)
    _, labels = csgraph.connected_components(graph, directed=False)
    return np.flatnonzero(labels == np.bincount(labels).argmax())


def dihedral_angles(positions, tets):
    """The six dihedral angles of each tetrahedron `[T, 6]`, degrees."""
    angles = []
    for i, j, k, m in [
        (0, 1, 2, 3),
        (0, 2, 1, 3),
        (0, 3, 1, 2),
        (1, 2, 0, 3),
        (1, 3, 0, 2),
        (2, 3, 0, 1),
    ]:
        edge = positions[tets[:, j]] - positions[tets[:, i]]
        one = np.cross(edge, positions[tets[:, k]] - positions[tets[:, i]])
        two = np.cross(edge, positions[tets[:, m]] - positions[tets[:, i]])
        cosine = np.einsum("ij,ij->i", one, two) / (np.linalg.norm(one, axis=1) * np.linalg.norm(two, axis=1))
        angles.append(np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0))))
    return np.column_stack(angles)


def inscribed_radii(positions, tets):
    """Radius of the inscribed sphere of each tetrahedron `[T]`: 3 V / (sum of face areas)."""
    area = np.zeros(len(tets))
    for face in FACES:
        a, b, c = (positions[tets[:, i]] for i in face)
        area += 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)
    return 3.0 * volumes(positions, tets) / area
