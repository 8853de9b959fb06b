"""Converts a label volume: INPUT OUTPUT [LABEL ...]. What it prints is told; `progress PERCENT` moves a bar."""

import sys
from pathlib import Path

import numpy as np

# Millimetres of a unit in a header, NIfTI and NRRD; without one it is taken as mm.
UNITS = {"meter": 1000.0, "m": 1000.0, "cm": 10.0, "micron": 0.001, "um": 0.001, "\u00b5m": 0.001}
# A volume with more labels is a scan.
MOST_LABELS = 1000
# Voxels of a volume, and of a slab that is looked at together.
MOST_VOXELS = 2 << 30
SLAB = 4 << 20
# Voxels that a box around the labels may have.
MOST_CROPPED = 100_000_000
# Bytes that ITK, which reads a volume whole, may take.
MOST_BYTES = 1.2e9
# Cells that a surface may cut; where it would cut more, it is taken at every second voxel, third and so on.
MOST_CELLS = 100_000


def isosurface(field):
    """Triangles where a field on a grid is 0, counter-clockwise from where it is below: each cell as six tetrahedra."""
    shape = np.array(field.shape)
    strides = np.array([shape[1] * shape[2], shape[2], 1])
    some = every = field > -1e-6
    for axis in range(3):
        low, high = ([slice(None)] * axis + [part] for part in (slice(-1), slice(1, None)))
        some, every = some[tuple(low)] | some[tuple(high)], every[tuple(low)] & every[tuple(high)]
    cells = np.argwhere(some & ~every) @ strides
    corner = {bits: np.array(bits) @ strides for bits in np.ndindex(2, 2, 2)}
    # Around the diagonal from (0, 0, 0) to (1, 1, 1): along the axes in every order; half of the orders are mirrored.
    tets = []
    for order, even in [((0, 1, 2), 1), ((1, 2, 0), 1), ((2, 0, 1), 1), ((0, 2, 1), 0), ((2, 1, 0), 0), ((1, 0, 2), 0)]:
        one, two = (tuple(int(axis in order[:n]) for axis in range(3)) for n in (1, 2))
        way = [corner[0, 0, 0], corner[one], corner[two], corner[1, 1, 1]]
        tets.append(cells[:, None] + np.array(way if even else [way[0], way[2], way[1], way[3]]))
    tets = np.concatenate(tets)

    def values(nodes):
        found = field.ravel()[nodes]
        return np.where(np.abs(found) < 1e-6, 1e-6, found)

    inside = values(tets) > 0
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
    edges, faces = np.unique(edges @ np.array([field.size, 1]), return_inverse=True)
    edges = np.stack(np.divmod(edges, field.size), 1)
    place = values(edges)
    # Not quite at a corner, where triangles would shrink to nothing.
    share = np.clip(place[:, 0] / (place[:, 0] - place[:, 1]), 0.05, 0.95)[:, None]
    ends = [np.stack(np.unravel_index(edges[:, k], shape), 1) for k in (0, 1)]
    return (1 - share) * ends[0] + share * ends[1], faces.reshape(-1, 3)


def in_mm(affine, unit):
    """Voxels to mm, of voxels to a unit."""
    scale = UNITS.get(unit, 1.0)
    if scale != 1:
        print(f"the header's unit is {unit}, {scale:g} mm")
    return np.diag([scale, scale, scale, 1]) @ affine


def nrrd_unit(path):
    """The unit of an NRRD header, which ITK does not heed; empty without one."""
    with path.open("rb") as file:
        head = file.read(1 << 16).split(b"\n\n")[0].decode("utf-8", "replace")
    found = [line.split('"') for line in head.splitlines() if line.startswith("space units:")]
    return found[0][1] if found and len(found[0]) > 1 else ""


def nifti(path):
    """Shape, voxels to mm (right, anterior, superior), names of labels, slabs along the last axis with their places."""
    import nibabel

    image = nibabel.load(path, keep_file_open=True)
    shape = image.shape[:3] + tuple(n for n in image.shape[3:] if n != 1)
    try:
        unit = image.header.get_xyzt_units()[0]
    except (AttributeError, KeyError):
        unit = "unknown"
    affine = in_mm(np.array(image.affine, float), unit)

    def slabs():
        deep = max(1, SLAB // max(1, shape[0] * shape[1]))
        for first in range(0, shape[2], deep):
            yield (
                first,
                image.dataobj[(slice(None), slice(None), slice(first, first + deep)) + (0,) * (len(image.shape) - 3)],
            )

    return shape, affine, {}, slabs


def itk(path):
    """The labels of a volume in NRRD or MetaImage form."""
    import SimpleITK

    SimpleITK.ProcessObject.SetGlobalWarningDisplay(False)
    reader = SimpleITK.ImageFileReader()
    reader.SetFileName(str(path))
    reader.ReadImageInformation()
    shape = tuple(n for at, n in enumerate(reader.GetSize()) if at < 3 or n != 1)
    if (layers := reader.GetNumberOfComponents()) != 1:
        sys.exit(
            f"{layers} numbers a voxel: segments that overlap; in 3D Slicer, export the segmentation as a label map"
        )
    if np.prod(reader.GetSize(), dtype=float) * bytes_of(reader) > MOST_BYTES:
        sys.exit(f"a volume of shape {shape} takes more than {MOST_BYTES / 1e9} GB; crop it, or save it as .nii.gz")
    dimension = reader.GetDimension()
    direction = np.array(reader.GetDirection()).reshape(dimension, dimension)[:3, :3]
    affine = np.eye(4)
    affine[:3, :3] = direction * np.array(reader.GetSpacing()[:3])
    affine[:3, 3] = reader.GetOrigin()[:3]
    # ITK counts to the left and back.
    affine[:2] *= -1
    affine = in_mm(affine, nrrd_unit(path))
    of = {key: reader.GetMetaData(key) for key in reader.GetMetaDataKeys()}
    names = {
        of.get(key[:-4] + "LabelValue"): of[key] for key in of if key.startswith("Segment") and key.endswith("_Name")
    }

    def slabs():
        # Axes from the last to the first.
        image = reader.Execute()
        volume = SimpleITK.GetArrayViewFromImage(image).reshape(shape[::-1])
        deep = max(1, SLAB // max(1, shape[0] * shape[1]))
        for first in range(0, shape[2], deep):
            yield first, volume[first : first + deep].transpose()

    return shape, affine, names, slabs


def bytes_of(reader):
    """Bytes of a voxel."""
    import SimpleITK

    name = SimpleITK.GetPixelIDValueAsString(reader.GetPixelID())
    return next((int(bits) // 8 for bits in ("8", "16", "32") if name.startswith(bits)), 8)


def check_box(voxels):
    """Refuses labels that take more memory than a desk computer has."""
    if voxels > MOST_CROPPED:
        sys.exit(
            f"its labels span more than {MOST_CROPPED // 10**6} million voxels; keep the organ, or use larger ones"
        )


def gather(shape, slabs):
    """What has labels, cropped: each voxel's place in a list of labels, that list (0 first), the box's first voxel."""
    names, pieces, nothing = [0], [], 0
    for first, slab in slabs:
        print(f"progress {100 * first // shape[2]}", flush=True)
        if slab.dtype.kind not in "biuf":
            sys.exit(f"a label volume has whole numbers, not {slab.dtype}")
        # What is nothing in other programs: NaN, and numbers below 0.
        if slab.dtype.kind in "if" and not np.all(slab >= 0):
            nothing += np.sum(~(slab >= 0))
            slab = np.where(slab >= 0, slab, 0)
        found = slab != 0
        if not found.any():
            continue
        sides = [np.flatnonzero(found.any(axis=tuple({0, 1, 2} - {axis}))) for axis in range(3)]
        low, high = (np.array([side[end] for side in sides]) for end in (0, -1))
        piece = slab[tuple(slice(a, b + 1) for a, b in zip(low, high, strict=True))]
        if piece.dtype.kind == "f" and not np.all(np.isfinite(piece) & (piece == np.round(piece))):
            sys.exit("a label volume has whole numbers, not 0.5 or infinity: is it a scan?")
        if piece.dtype.itemsize > 2 and piece.max() < 1 << 16:
            piece = piece.astype(np.uint16)
        own, places = np.unique(piece, return_inverse=True)
        names += sorted({int(name) for name in own} - set(names))
        if len(names) > MOST_LABELS:
            sys.exit(f"more than {MOST_LABELS} labels: is it a scan?")
        to = np.array([names.index(name) for name in own], np.uint16)
        check_box(piece.size + sum(piece.size for _, piece in pieces))
        low[2] += first
        pieces.append((low, to[places].reshape(piece.shape)))
    if nothing:
        print(f"{nothing} voxels of negative labels or NaN are background")
    if not pieces:
        sys.exit("the volume holds no label but 0")
    low = np.min([low for low, _ in pieces], 0)
    high = np.max([low + piece.shape for low, piece in pieces], 0)
    check_box(np.prod(high - low, dtype=float))
    volume = np.zeros(high - low, np.uint16)
    while pieces:
        at, piece = pieces.pop()
        volume[tuple(slice(a, a + n) for a, n in zip(at - low, piece.shape, strict=True))] = piece
    return volume, names, low


def coarser(inside, by):
    """The share of blocks of `by` voxels a side that is inside."""
    if by == 1:
        return inside.astype(np.float32)
    inside = np.pad(inside, [(0, -n % by) for n in inside.shape])
    blocks = sum(inside[i::by, j::by, k::by].astype(np.float32) for i, j, k in np.ndindex(by, by, by))
    return blocks / by**3


def write(inside, affine, file):
    """Writes the surface of voxels; returns how much of their volume it holds, 0 where it is none."""
    from scipy.ndimage import gaussian_filter

    sides = (np.diff(inside, axis=axis, prepend=False, append=False) for axis in range(3))
    faces_of_voxels = sum(np.count_nonzero(side) for side in sides)
    by = int(np.ceil(np.sqrt(max(1, faces_of_voxels / MOST_CELLS))))
    field = gaussian_filter(np.pad(coarser(inside, by), 3), 0.8, output=np.float32) - np.float32(0.5)
    if not np.any(field > 0):
        return 0, by
    points, faces = isosurface(field)
    points = (points - 3) * by + (by - 1) / 2
    points = points @ affine[:3, :3].T + affine[:3, 3]
    if np.linalg.det(affine[:3, :3]) < 0:
        faces = faces[:, ::-1]
    head = "ply\nformat binary_little_endian 1.0\ncomment SPACE=RAS\n"
    head += f"element vertex {len(points)}\nproperty double x\nproperty double y\nproperty double z\n"
    head += f"element face {len(faces)}\nproperty list uchar int vertex_indices\nend_header\n"
    rows = np.empty(len(faces), [("count", "u1"), ("nodes", "<i4", 3)])
    rows["count"], rows["nodes"] = 3, faces
    file.write_bytes(head.encode() + points.astype("<f8").tobytes() + rows.tobytes())
    a, b, c = (points[faces[:, k]] - points.mean(0) for k in range(3))
    volume = np.einsum("ij,ij->", a, np.cross(b, c)) / 6
    return volume / (np.count_nonzero(inside) * abs(np.linalg.det(affine[:3, :3]))), by


def convert(path, out, wanted):
    """The surface of the wanted labels (or all) together as a .ply in mm, and one of each label beside it."""
    from scipy.ndimage import find_objects

    read = nifti if path.name.lower().endswith((".nii", ".nii.gz")) else itk
    try:
        shape, affine, called, slabs = read(path)
        if len(shape) != 3:
            sys.exit(f"a label volume has three axes, this has {len(shape)}: shape {shape}")
        if np.prod(shape, dtype=float) > MOST_VOXELS or shape[0] * shape[1] > 16 * SLAB:
            sys.exit(f"a volume of shape {shape} is too large; crop it to the organ")
        size = abs(np.linalg.det(affine[:3, :3])) if np.all(np.isfinite(affine)) else 0
        if size == 0:
            sys.exit(
                "its affine (srow_x to srow_z, pixdim; NRRD: space directions) is zero or flat: set the voxel size"
            )
        labels, names, low = gather(shape, slabs())
    except Exception as error:  # the libraries have no base class for what may be wrong with a file
        reason = "ITK cannot read it" if read is itk else (f"{error}".splitlines() or [repr(error)])[0]
        sys.exit(f"{reason}: is the file a label volume, and whole?")
    known = sorted(names[1:])
    if missing := [name for name in wanted if name not in known]:
        sys.exit(f"--label: no voxel has label {missing[0]}; the volume has {', '.join(map(str, known[:40]))}")
    affine[:3, 3] += affine[:3, :3] @ low
    inside = np.zeros(labels.shape, bool) if wanted else labels != 0
    for name in wanted:
        inside |= labels == names.index(name)
    share, by = write(inside, affine, out)
    if share == 0:
        sys.exit("what the volume labels is thinner than two voxels")
    if by > 1:
        print(
            f"the surface is taken at every {by} voxels along each axis: the volume is finer than a body of tetrahedra"
        )
    if share < 0.95:
        print(f"the surface holds {100 * share:.0f} % of the labelled voxels: parts thinner than {2 * by} are lost")
    if len(known) > 1:
        boxes = find_objects(labels)
        for name in known:
            box = boxes[names.index(name) - 1]
            found = labels[box] == names.index(name)
            first = np.array([side.start for side in box])
            own = affine.copy()
            own[:3, 3] += affine[:3, :3] @ first
            counts = [np.count_nonzero(found, axis=tuple({0, 1, 2} - {axis})) for axis in range(3)]
            middle = own[:3, :3] @ [np.average(np.arange(len(n)), weights=n) for n in counts] + own[:3, 3]
            title = f"label {name} ({called[str(name)]})" if str(name) in called else f"label {name}"
            title += f": {np.sum(found) * size / 1000:.1f} ml at ({', '.join(f'{x:.0f}' for x in middle)}) mm"
            file = out.with_name(f"label-{name}.ply")
            if write(found, own, file)[0]:
                print(f"{title}; alone with --label {name}, stiffer with --stiffness inside:{file}=FACTOR")
            else:
                print(f"{title}, too small for a surface")


if __name__ == "__main__":
    convert(Path(sys.argv[1]), Path(sys.argv[2]), [int(name) for name in sys.argv[3:]])
