"""Nothing reaches BVH or GPU unchecked: finite numbers, indices in range, unit normals, no degenerate triangle."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..errors import UserError
from . import geometry
from .model import F32, F64, U32, Instance, Mesh
from .motion import Motion

# 32-byte vertices and 16-byte triangles: this many fill 1.6 GB, the most a present-day desktop GPU can be asked to hold
# beside the BVH. Above it, decoding alone would take minutes.
MAX_VERTICES = 50_000_000
MAX_TRIANGLES = 50_000_000
MAX_COORDINATE = 1e9  # m: areas, and their sums over all triangles, stay finite in float32
MAX_TEXTURE_COORDINATE = 1e9  # times a texture's scale (bounded.py) its square still fits into float32
RESOLVED = 4096  # pixels across the largest pictures: steps of float32 that a mesh must span, or it is reported
FINE_STEP = 1e-3  # m: a scene that float32 resolves no better at its rim is reported
MAX_MOVING = 255  # objects: their index shares a 32-bit word with the material's (app/gpu/arrays.py)


@dataclass(frozen=True)
class RawMesh:
    """What a decoder found, before any check; `None` where the file gives nothing."""

    positions: F32  # (n, 3)
    triangles: NDArray[np.integer]  # (m, 3)
    material: int
    normals: F32 | None = None  # (n, 3)
    uvs: F32 | None = None  # (n, 2)
    tangents: F32 | None = None  # (n, 4)
    colors: F32 | None = None  # (n, 4) linear vertex colours
    name: str = ""


@dataclass
class Repairs:
    """How much was wrong and put right, over all meshes of a file."""

    degenerate: int = 0
    computed_normals: int = 0  # meshes
    repaired_normals: int = 0  # vertices
    computed_tangents: int = 0  # meshes
    coarse: int = 0  # meshes
    coarsest_step: float = 0.0  # m

    def notes(self) -> list[str]:
        found = []
        if self.computed_normals:
            found.append(
                f"{count(self.computed_normals, 'mesh', 'meshes')} without normals got area-weighted smooth ones."
            )
        if self.repaired_normals:
            found.append(f"{count(self.repaired_normals, 'zero or non-finite normal')} recomputed from the triangles.")
        if self.computed_tangents:
            found.append(
                f"Tangents were computed for {count(self.computed_tangents, 'mesh', 'meshes')} with a normal map."
            )
        if self.coarse:
            lie = "lies so far from its own origin" if self.coarse == 1 else "lie so far from their own origins"
            found.append(
                f"{count(self.coarse, 'mesh', 'meshes')} {lie} that 32-bit numbers place vertices only to "
                f"{length(self.coarsest_step)}: move it there and place it by its node."
            )
        return found

    def see(self, positions: F32) -> None:
        """Count a mesh whose vertices float32 resolves no better than a picture resolves the mesh."""
        step = float(np.spacing(np.abs(positions).max(initial=0.0)))
        diagonal = float(np.linalg.norm(np.ptp(positions.astype(np.float64), axis=0))) if len(positions) else 0.0
        if step * RESOLVED > diagonal > 0.0:
            self.coarse, self.coarsest_step = self.coarse + 1, max(self.coarsest_step, step)


def length(metres: float) -> str:
    """'7.8 mm', '141 km'."""
    scale, unit = next(((s, u) for s, u in ((1e3, "km"), (1.0, "m"), (1e-3, "mm")) if metres >= s), (1e-6, "um"))
    return f"{metres / scale:.{3 if scale > 1.0 else 2}g} {unit}"


def count(number: int, singular: str, plural: str | None = None) -> str:
    """'1 light', '3 lights'."""
    return f"{number} {singular if number == 1 else plural or singular + 's'}"


def check_counts(vertices: int, triangles: int, where: str) -> None:
    """Raise UserError, naming `where`, if that is more than can be held."""
    if vertices > MAX_VERTICES or triangles > MAX_TRIANGLES:
        raise UserError(
            f"{where} has {vertices} vertices and {triangles} triangles, over the limit of {MAX_TRIANGLES}: simplify "
            "it."
        )


def check(raw: RawMesh, where: str) -> None:
    """Raise UserError, naming `where`, unless the arrays are finite, in range and of agreeing length."""
    n, m = len(raw.positions), len(raw.triangles)
    check_counts(n, m, where)
    if raw.positions.shape != (n, 3) or raw.triangles.shape != (m, 3):
        raise UserError(f"{where} has positions or faces that are not of three numbers each: re-export the file.")
    for kind, width in (("normals", 3), ("uvs", 2), ("tangents", 4), ("colors", 4)):
        array = getattr(raw, kind)
        if array is not None and len(array) != n:
            raise UserError(f"{where} has {n} positions but {len(array)} {kind}: re-export the file.")
        if array is not None and array.shape != (n, width):
            raise UserError(f"{where} has {kind} that are not of {width} numbers each: re-export the file.")
    if m and (int(raw.triangles.min()) < 0 or int(raw.triangles.max()) >= n):
        raise UserError(f"{where} has a triangle index outside its {n} vertices: re-export the file.")
    if not np.isfinite(raw.positions).all():
        raise UserError(f"{where} has a vertex position that is not a finite number: re-export the file.")
    if np.abs(raw.positions).max(initial=0.0) > MAX_COORDINATE:
        raise UserError(
            f"{where} has a vertex farther than {MAX_COORDINATE:g} m from the origin: scale the model down."
        )
    if raw.uvs is not None and not (np.abs(raw.uvs) <= MAX_TEXTURE_COORDINATE).all():  # NaN fails as well
        raise UserError(
            f"{where} has a texture coordinate that is not a finite number or beyond {MAX_TEXTURE_COORDINATE:g}: "
            "re-export the file."
        )


def check_placed(extent: F64, instance: Instance, where: str) -> F64:
    """Raise UserError unless the instance is within MAX_COORDINATE of the origin at time 0 (a NaN transform is not).

    `extent` is the largest absolute coordinate of its mesh along each axis (3,) [m]. Returns how far from the origin it
    reaches along each axis (3,) [m].
    """
    linear, offset = instance.transform[:3, :3], instance.transform[:3, 3]
    with np.errstate(over="ignore", invalid="ignore"):
        reach = np.abs(linear) @ extent + np.abs(offset)
    _check_reach(reach, where)
    return reach


def check_moving(motion: Motion, reach: F64, where: str) -> None:
    """The same at all times for what reaches so far along each axis at time 0."""
    with np.errstate(over="ignore", invalid="ignore"):
        swept = np.abs(motion.swept(-reach, reach)).max(axis=0)
    _check_reach(swept, where)


def _check_reach(reach: F64, where: str) -> None:
    if not (reach <= MAX_COORDINATE).all():
        raise UserError(f"{where} is placed too far from the origin ({MAX_COORDINATE:g} m at most): move or scale it.")


def clean(raw: RawMesh, where: str, normal_map: NDArray[np.floating] | None, repairs: Repairs) -> Mesh:
    """The checked mesh, complete with unit normals and, where `normal_map` (its 2x3 uv transform) is given, tangents.

    Degenerate triangles and unused vertices are dropped; `repairs` counts what was done. Raises UserError as `check`.
    """
    check(raw, where)
    triangles = raw.triangles.astype(np.uint32)
    broken = geometry.degenerate(raw.positions, triangles)
    repairs.degenerate += int(broken.sum())
    source, triangles = geometry.used_vertices(triangles[~broken], len(raw.positions))
    positions = np.ascontiguousarray(raw.positions[source], np.float32)
    repairs.see(positions)
    normals = _normals(positions, triangles, None if raw.normals is None else raw.normals[source], repairs)
    uvs = (
        np.zeros((len(source), 2), np.float32) if raw.uvs is None else np.ascontiguousarray(raw.uvs[source], np.float32)
    )
    mesh = Mesh(positions, normals, uvs, np.zeros((len(source), 4), np.float32), triangles, raw.material, raw.name)
    if normal_map is None or raw.uvs is None:
        return mesh
    given = _usable_tangents(None if raw.tangents is None else raw.tangents[source], normals)
    if given is not None:
        return replace(mesh, tangents=given)
    repairs.computed_tangents += 1
    return with_tangents(mesh, normal_map)


def with_tangents(mesh: Mesh, normal_map: NDArray[np.floating]) -> Mesh:
    """The mesh with computed tangents for uvs transformed by the 2x3 matrix; vertices on mirror seams are doubled."""
    texture_uvs = (mesh.uvs @ normal_map[:, :2].T + normal_map[:, 2]).astype(np.float32)
    source, triangles = geometry.split_mirrored(texture_uvs, mesh.triangles)
    positions, normals = mesh.positions[source], mesh.normals[source]
    tangents = geometry.tangents(positions, normals, texture_uvs[source], triangles)
    return Mesh(positions, normals, mesh.uvs[source], tangents, triangles, mesh.material, mesh.name)


def _normals(positions: F32, triangles: U32, given: F32 | None, repairs: Repairs) -> F32:
    if given is None:
        repairs.computed_normals += 1
        return geometry.area_weighted_normals(positions, triangles).astype(np.float32)
    normals = geometry.unit(given)
    lost = ~normals.any(axis=1)
    if lost.any():
        repairs.repaired_normals += int(lost.sum())
        normals[lost] = geometry.area_weighted_normals(positions, triangles)[lost]
    return normals.astype(np.float32)


def _usable_tangents(given: F32 | None, normals: F32) -> F32 | None:
    """The file's tangents made unit and orthogonal to the normals, or None when any has no direction left."""
    if given is None:
        return None
    n, t = normals.astype(np.float64), geometry.unit(given[:, :3])
    t = geometry.unit(t - n * np.einsum("ij,ij->i", n, t)[:, None])
    if not t.any(axis=1).all():
        return None
    handedness = np.where(given[:, 3:] < 0.0, -1.0, 1.0)
    return np.hstack([t, handedness]).astype(np.float32)
