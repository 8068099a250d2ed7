"""glTF accessors as numpy arrays: interleaved, normalised, sparse. glTF 2.0 specification, section 3.6.2."""

from __future__ import annotations

from typing import cast

import numpy as np
from numpy.typing import NDArray

from ..errors import quoted
from .gltf_file import GltfFile, Json
from .model import F32
from .validate import MAX_TRIANGLES

_DTYPES = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
_COMPONENTS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}
# Elements of an accessor without a view, which are all zero but for a few: it takes no bytes of the file, so nothing
# else keeps a hundred bytes from becoming a gigabyte.
MAX_ZEROS = 1 << 20
_LARGEST = {"i1": 127.0, "u1": 255.0, "i2": 32767.0, "u2": 65535.0}


def read_integers(file: GltfFile, index: object) -> NDArray[np.integer]:
    """(count,) integers as stored, for triangle indices."""
    accessor = file.item("accessors", index)
    values = _values(file, accessor, f"accessors[{index}]")
    if values.dtype.kind == "f" or values.shape[1] != 1:
        raise file.broken(f"uses accessors[{index}] as indices, but it does not hold integers")
    return cast("NDArray[np.integer]", values[:, 0])


def read_floats(file: GltfFile, index: object, components: tuple[int, ...]) -> F32:
    """(count, c) float32, normalised integers mapped to [0, 1] or [-1, 1]; `components` lists the widths allowed."""
    accessor = file.item("accessors", index)
    values = _values(file, accessor, f"accessors[{index}]")
    if values.shape[1] not in components:
        raise file.broken(f"has {values.shape[1]} components in accessors[{index}] where {components} belong")
    stored = values.dtype.str[1:]
    floats = values.astype(np.float32)
    if accessor.get("normalized", False) and stored in _LARGEST:
        floats = np.maximum(floats / np.float32(_LARGEST[stored]), np.float32(-1.0))
    return floats


def _values(file: GltfFile, accessor: Json, where: str) -> NDArray[np.generic]:
    """(count, c) array in the stored type, sparse replacements applied."""
    count = int(accessor["count"])
    dtype, width = np.dtype(_DTYPES[accessor["componentType"]]), _COMPONENTS[accessor["type"]]
    most = 3 * MAX_TRIANGLES if "bufferView" in accessor else MAX_ZEROS
    if not 0 <= count <= most:
        raise file.broken(f"claims {quoted(count)} elements in {where}")
    if "bufferView" in accessor:
        base = _strided(file, accessor["bufferView"], int(accessor.get("byteOffset", 0)), count, width, dtype, where)
    else:
        base = np.zeros((count, width), dtype)
    return _with_sparse(file, accessor["sparse"], base, where) if "sparse" in accessor else base


def _strided(
    file: GltfFile, view: object, offset: int, count: int, width: int, dtype: np.dtype, where: str
) -> NDArray[np.generic]:
    data, stride = file.view(view)
    element = width * dtype.itemsize
    stride = stride or element
    end = offset + (count - 1) * stride + element if count else offset
    if offset < 0 or stride < element or end > len(data):
        raise file.broken(f"has {where} reaching past the end of its bufferView")
    return np.ndarray((count, width), dtype, data, offset, (stride, dtype.itemsize))


def _with_sparse(file: GltfFile, sparse: Json, base: NDArray[np.generic], where: str) -> NDArray[np.generic]:
    count, at, new = int(sparse["count"]), sparse["indices"], sparse["values"]
    index_type = np.dtype(_DTYPES[at["componentType"]])
    if not 0 <= count <= len(base) or index_type.kind != "u":
        raise file.broken(f"has a damaged sparse part in {where}")
    indices = _strided(file, at["bufferView"], int(at.get("byteOffset", 0)), count, 1, index_type, where)[:, 0]
    values = _strided(file, new["bufferView"], int(new.get("byteOffset", 0)), count, base.shape[1], base.dtype, where)
    if count and int(indices.max()) >= len(base):
        raise file.broken(f"has a sparse index out of range in {where}")
    patched = base.copy()
    patched[indices] = values
    return patched
