"""Writes a brain in the mesh format of docs/reference/formats.md, the same bytes for the same mesh.

The safetensors library writes metadata in no fixed order, so the header is written here.
"""

import hashlib
import json

import numpy as np

LICENSE = (
    "Derived from the fsaverage5 surfaces of FreeSurfer, Copyright (c) 2011 The General Hospital "
    "Corporation (Boston, MA), FreeSurfer Software License; see NOTICE"
)
SOURCE = (
    "fsaverage5 pial surfaces (Fischl et al. 1999, Human Brain Mapping 8, 272-284) by nilearn; "
    "signed distance on 1 mm voxels, sulci closed with 4 mm; isosurface stuffing "
    "(Labelle and Shewchuk 2007) at a lattice spacing of {spacing} mm; "
    "python -m upt_training.anatomy"
)


def tensors(brain):
    """The mesh's tensors, in the file's dtypes."""
    return {
        "positions": brain.positions.astype(np.float32),
        "tets": brain.tets.astype(np.int32),
        "surface": brain.surface.astype(np.int32),
        "domain": brain.domain.astype(np.int32),
        "fixed": brain.fixed.astype(np.int32),
        "supported": brain.supported.astype(np.int32),
    }


def mesh_hash(arrays):
    """The mesh hash of docs/reference/formats.md."""
    digest = hashlib.sha256()
    for name in ("positions", "tets", "fixed", "supported"):
        digest.update(arrays[name].tobytes())
    return digest.hexdigest()


def save(brain, name, path):
    """Writes `path`, returns the mesh hash."""
    arrays = tensors(brain)
    header = {
        "__metadata__": {
            "format": "upt-mesh",
            "version": "1",
            "name": name,
            "units": "mm",
            "source": SOURCE.format(spacing=brain.spacing),
            "license": LICENSE,
        }
    }
    offset = 0
    for key, array in arrays.items():
        header[key] = {
            "dtype": {"float32": "F32", "int32": "I32"}[array.dtype.name],
            "shape": list(array.shape),
            "data_offsets": [offset, offset + array.nbytes],
        }
        offset += array.nbytes
    text = json.dumps(header, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 8)
    with open(path, "wb") as file:
        file.write(len(text).to_bytes(8, "little"))
        file.write(text)
        for array in arrays.values():
            file.write(np.ascontiguousarray(array, array.dtype.newbyteorder("<")).tobytes())
    return mesh_hash(arrays)
