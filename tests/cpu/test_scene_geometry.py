"""Normals, tangents, degenerate triangles and the baking of instances, mostly by identities."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from app.errors import UserError
from app.scene import geometry
from app.scene.flatten import bounds, flatten
from app.scene.model import Instance, Material, Mesh, Scene
from app.scene.validate import RawMesh, Repairs, clean

IDENTITY_UV = np.eye(2, 3)


def ball(segments: int = 24, rings: int = 12) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """(positions, outward normals, uvs: u east, v south; triangles) of a unit sphere without its poles."""
    lon = np.linspace(0.0, 2.0 * np.pi, segments + 1)
    lat = np.linspace(1.2, -1.2, rings + 1)
    phi, theta = (a.ravel() for a in np.meshgrid(lon, lat))
    normals = np.stack([np.cos(theta) * np.sin(phi), np.sin(theta), np.cos(theta) * np.cos(phi)], 1)
    uvs = np.stack([phi / (2 * np.pi), (1.2 - theta) / 2.4], 1)
    corner = (np.arange(rings)[:, None] * (segments + 1) + np.arange(segments)).ravel()
    below = corner + segments + 1
    triangles = np.concatenate([np.stack([corner, below, corner + 1], 1), np.stack([corner + 1, below, below + 1], 1)])
    return normals.astype(np.float32), normals, uvs.astype(np.float32), triangles.astype(np.uint32)


def mesh_of(raw: RawMesh, normal_map: np.ndarray | None = None) -> tuple[Mesh, Repairs]:
    repairs = Repairs()
    return clean(raw, "test", normal_map, repairs), repairs


def scene_of(mesh: Mesh, *transforms: np.ndarray) -> Scene:
    return Scene((mesh,), (Material(),), tuple(Instance(0, t) for t in transforms))


affine = st.lists(st.floats(-2, 2), min_size=12, max_size=12).map(
    lambda v: np.vstack([np.reshape(v, (3, 4)), [0.0, 0.0, 0.0, 1.0]])
)


def test_degenerate_means_repeated_or_exactly_flat() -> None:
    thin = np.float32(1e-30)
    positions = np.array([[0, 0, 0], [1, 0, 0], [2, 0, 0], [0, 1, 0], [0, thin, 0]], np.float32)
    triangles = np.array([[0, 1, 3], [0, 1, 2], [0, 0, 3], [0, 3, 3], [0, 1, 4]], np.uint32)
    assert geometry.degenerate(positions, triangles).tolist() == [False, True, True, True, False]


def test_dropping_degenerates_also_drops_their_vertices() -> None:
    positions = np.array([[9, 9, 9], [0, 0, 0], [1, 0, 0], [0, 1, 0], [2, 0, 0]], np.float32)
    mesh, repairs = mesh_of(RawMesh(positions, np.array([[1, 2, 3], [1, 2, 4], [0, 0, 1]]), 0))
    assert repairs.degenerate == 2
    assert np.array_equal(mesh.positions[mesh.triangles[0]], positions[[1, 2, 3]])
    assert len(mesh.positions) == 3


def test_computed_normals_of_a_ball_point_outwards() -> None:
    positions, normals, _, triangles = ball()
    computed = geometry.area_weighted_normals(positions, triangles)
    inner = np.abs(positions[:, 1]) < 0.9  # border rows see faces on one side only
    inner &= (np.abs(positions[:, 0]) > 1e-6) | (positions[:, 2] < 0)  # and so does the uv seam
    assert (np.einsum("ij,ij->i", computed, normals)[inner] > 0.995).all()


@settings(deadline=None, max_examples=30)
@given(scale=st.floats(1e-12, 1e12))
def test_normals_do_not_depend_on_scale(scale: float) -> None:
    positions, _, _, triangles = ball(8, 4)
    scaled = (positions * np.float32(scale)).astype(np.float32)
    at_one = geometry.area_weighted_normals(positions, triangles)
    assert np.allclose(geometry.area_weighted_normals(scaled, triangles), at_one, atol=1e-5)


def test_given_normals_are_repaired_where_they_say_nothing() -> None:
    positions, normals, _, triangles = ball()
    given_normals = (normals * 7).astype(np.float32)
    given_normals[30], given_normals[31] = 0.0, np.nan
    mesh, repairs = mesh_of(RawMesh(positions, triangles, 0, given_normals))
    assert repairs.repaired_normals == 2
    assert np.allclose(np.linalg.norm(mesh.normals, axis=1), 1.0, atol=1e-6)
    assert (np.einsum("ij,ij->i", mesh.normals, normals) > 0.99).all()


def test_unit_survives_extremes() -> None:
    rows = np.array([[1e300, 1e300, 0], [1e-300, 0, 0], [0, 0, 0], [np.inf, 0, 0], [np.nan, 1, 0]])
    expected = np.array([[0.5**0.5, 0.5**0.5, 0], [1, 0, 0], [0, 0, 0], [0, 0, 0], [0, 0, 0]])
    assert np.allclose(geometry.unit(rows), expected)


def test_tangents_follow_u_and_bitangents_climb_against_v() -> None:
    positions, normals, uvs, triangles = ball(48, 24)
    t = geometry.tangents(positions, normals.astype(np.float32), uvs, triangles).astype(float)
    east = np.stack([normals[:, 2], np.zeros(len(normals)), -normals[:, 0]], 1)
    east /= np.linalg.norm(east, axis=1, keepdims=True)
    north = np.cross(normals, east)
    assert (np.einsum("ij,ij->i", t[:, :3], east) > 0.99).all()
    bitangent = np.cross(normals, t[:, :3]) * t[:, 3:]
    assert (np.einsum("ij,ij->i", bitangent, north) > 0.99).all()
    assert np.allclose(np.einsum("ij,ij->i", t[:, :3], normals), 0.0, atol=1e-6)


def test_mirrored_uvs_get_their_own_vertices() -> None:
    positions = np.array([[0, 0, 0], [0, 1, 0], [-1, 0, 0], [1, 0, 0]], np.float32)
    uvs = np.array([[0, 1], [0, 0], [1, 1], [1, 1]], np.float32)  # both halves show the same texture, mirrored at x = 0
    triangles = np.array([[0, 1, 2], [0, 3, 1]])
    mesh, _ = mesh_of(RawMesh(positions, triangles, 0, None, uvs), IDENTITY_UV)
    assert len(mesh.positions) == 6
    for face, towards in zip(mesh.triangles, (-1.0, 1.0), strict=True):
        assert np.allclose(mesh.tangents[face, :3], (towards, 0, 0), atol=1e-6)
        up = np.cross(mesh.normals[face], mesh.tangents[face, :3]) * mesh.tangents[face, 3:]
        assert np.allclose(up, (0, 1, 0), atol=1e-6)


def test_tangents_without_usable_uvs_are_still_a_frame() -> None:
    positions, normals, uvs, triangles = ball()
    mesh, _ = mesh_of(RawMesh(positions, triangles, 0, normals.astype(np.float32), uvs * 0), IDENTITY_UV)
    assert np.allclose(np.linalg.norm(mesh.tangents[:, :3], axis=1), 1.0, atol=1e-6)
    assert np.allclose(np.einsum("ij,ij->i", mesh.tangents[:, :3], mesh.normals), 0.0, atol=1e-6)


def test_flatten_by_the_identity_changes_nothing() -> None:
    positions, normals, uvs, triangles = ball()
    mesh, _ = mesh_of(RawMesh(positions, triangles, 0, normals.astype(np.float32), uvs), IDENTITY_UV)
    flat = flatten(scene_of(mesh, np.eye(4)))
    assert np.array_equal(flat.positions, mesh.positions)
    assert np.array_equal(flat.indices, mesh.triangles)
    assert np.allclose(flat.normals, mesh.normals, atol=1e-7)
    assert np.allclose(flat.tangents, mesh.tangents, atol=1e-7)
    assert flat.materials.dtype == np.uint32


@settings(deadline=None, max_examples=60)
@given(transform=affine)
def test_normals_stay_perpendicular_and_on_their_side(transform: np.ndarray) -> None:
    """Inverse-transpose normals: n'.(M e) = 0 for edges e in the face, and n'.(M n) > 0, mirrored or not."""
    if abs(np.linalg.det(transform[:3, :3])) < 0.05:
        return
    positions = np.array([[0.1, 0.2, 0.3], [1, 0.5, 0], [0, 1, 0.7]], np.float32)
    uvs = np.array([[0, 0], [1, 0], [0, -1]], np.float32)
    mesh, _ = mesh_of(RawMesh(positions, np.array([[0, 1, 2]]), 0, None, uvs), IDENTITY_UV)
    flat = flatten(scene_of(mesh, transform))
    p, linear = positions.astype(float), transform[:3, :3]
    edges = np.stack([p[1] - p[0], p[2] - p[0]]) @ linear.T
    size = np.linalg.norm(edges, axis=1)
    assert np.allclose(flat.normals @ edges.T / size, 0.0, atol=2e-6 * np.linalg.cond(linear))
    assert (flat.normals @ (linear @ mesh.normals[0]) > 0).all()
    # The frame follows the texture: tangent along the u edge, bitangent towards the -v edge.
    tangent, w = flat.tangents[0, :3], flat.tangents[0, 3]
    bitangent = np.cross(flat.normals[0], tangent) * w
    assert tangent @ edges[0] > 0
    across = edges[1] - tangent * (tangent @ edges[1])
    assert bitangent @ across > -1e-6


def test_flatten_drops_what_a_transform_collapses() -> None:
    positions, _, _, triangles = ball(8, 4)
    mesh, _ = mesh_of(RawMesh(positions, triangles, 0))
    flat = flatten(scene_of(mesh, np.diag([0.0, 0.0, 0.0, 1.0]), np.eye(4), np.diag([1.0, 0.0, 0.0, 1.0])))
    assert len(flat.indices) == len(mesh.triangles)
    assert flat.indices.min() >= len(mesh.positions), "the middle instance is what remains"


@settings(deadline=None, max_examples=30)
@given(transform=affine)
def test_bounds_enclose_exactly_the_flattened_vertices(transform: np.ndarray) -> None:
    positions, _, _, triangles = ball(8, 4)
    mesh, _ = mesh_of(RawMesh(positions, triangles, 0))
    scene = scene_of(mesh, transform, np.eye(4))
    low, high = bounds(flatten(scene))
    placed = np.concatenate([mesh.positions @ m[:3, :3].T + m[:3, 3] for m in (transform, np.eye(4))])
    assert np.allclose(placed.min(axis=0), low, atol=1e-5)
    assert np.allclose(placed.max(axis=0), high, atol=1e-5)


def test_empty_scene_flattens_to_nothing() -> None:
    flat = flatten(Scene((), (), ()))
    assert flat.positions.shape == (0, 3)
    assert flat.indices.shape == (0, 3)
    assert np.array_equal(bounds(flat), np.zeros((2, 3)))


@pytest.mark.parametrize(
    ("field", "value", "says"),
    [
        ("positions", np.full((3, 3), np.inf, np.float32), "not a finite number"),
        ("positions", np.full((3, 3), 1e12, np.float32), "farther than"),
        ("uvs", np.full((3, 2), np.nan, np.float32), "texture coordinate"),
        ("uvs", np.zeros((2, 2), np.float32), "2 uvs"),
        ("triangles", np.array([[0, 1, -1]]), "triangle index"),
    ],
)
def test_invalid_arrays_are_refused(field: str, value: np.ndarray, says: str) -> None:
    fields = {"positions": np.eye(3, dtype=np.float32), "triangles": np.array([[0, 1, 2]]), "material": 0}
    with pytest.raises(UserError, match=says):
        clean(RawMesh(**(fields | {field: value})), "test", None, Repairs())
