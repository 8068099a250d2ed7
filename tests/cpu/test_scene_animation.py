"""glTF animations: what they move and how, what is left out with a note, and hostile ones that end in one sentence."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from app.errors import UserError
from app.scene.flatten import flatten
from app.scene.gltf_nodes import MAX_JOINTS
from app.scene.load import load_scene
from app.scene.model import Scene
from app.scene.validate import MAX_MOVING

from .gltf_maker import CORNERS, Maker
from .test_motion import IDENTITY, spin


def animate(
    maker: Maker, node: int, path: str, times: Any, values: Any, method: str = "LINEAR", **sampler: Any
) -> None:
    if "animations" not in maker.json:
        maker.add("animations", {"samplers": [], "channels": []})
    animation = maker.json["animations"][0]
    given = {"input": maker.accessor(np.asarray(times, "<f4")), "output": maker.accessor(np.asarray(values, "<f4"))}
    animation["samplers"].append({**given, "interpolation": method, **sampler})
    animation["channels"].append({"sampler": len(animation["samplers"]) - 1, "target": {"node": node, "path": path}})


def loaded(maker: Maker, folder: Path) -> Scene:
    return load_scene(maker.write(folder / "scene.glb"))


def arm(maker: Maker) -> tuple[int, int]:
    """A shoulder that carries a hand with a triangle, 2 m out."""
    mesh = maker.mesh(maker.primitive(maker.accessor(CORNERS)))
    hand = maker.node(root=False, mesh=mesh, translation=[2, 0, 0])
    return maker.node(children=[hand], translation=[0, 1, 0]), hand


def test_an_animated_ancestor_moves_its_children(tmp_path: Path) -> None:
    maker = Maker()
    shoulder, _ = arm(maker)
    maker.triangle()
    animate(maker, shoulder, "rotation", [0, 1, 2], [IDENTITY, spin(2, 90), spin(2, 180)])
    scene = loaded(maker, tmp_path)
    moving = [i for i in scene.instances if i.motion]
    assert len(moving) == 1
    assert len(scene.instances) == 2
    assert moving[0].transform[:3, 3].tolist() == [2, 1, 0]
    assert moving[0].motion is not None
    assert moving[0].motion.period == 2.0
    place = moving[0].motion.displacement(1.0) @ moving[0].transform
    np.testing.assert_allclose(place[:3, 3], [0, 3, 0], atol=1e-6)


def test_nested_animations_multiply_and_make_objects_of_their_own(tmp_path: Path) -> None:
    maker = Maker()
    shoulder, hand = arm(maker)
    animate(maker, shoulder, "translation", [0, 4], [[0, 1, 0], [0, 5, 0]])
    animate(maker, hand, "rotation", [0, 2], [IDENTITY, spin(2, 90)])
    (instance,) = loaded(maker, tmp_path).instances
    assert instance.motion is not None
    place = instance.motion.displacement(2.0) @ instance.transform
    np.testing.assert_allclose(place @ [1, 0, 0, 1], [2, 4, 0, 1], atol=1e-6)
    assert instance.motion.period == 4.0


def test_a_pose_at_time_zero_is_where_still_things_stand(tmp_path: Path) -> None:
    """The keys replace the node's own values; cameras and lights keep the pose of time 0, with a note."""
    maker = Maker()
    shoulder, _ = arm(maker)
    eye = maker.add("cameras", {"type": "perspective", "perspective": {"yfov": 1.0}})
    maker.json["nodes"][shoulder]["children"].append(maker.node(root=False, camera=eye))
    animate(maker, shoulder, "translation", [0.5, 1], [[7, 0, 0], [9, 0, 0]])
    scene = loaded(maker, tmp_path)
    assert scene.cameras[0].eye == (7, 0, 0)
    assert scene.instances[0].transform[:3, 3].tolist() == [9, 0, 0]
    assert any("Cameras and lights do not move" in note for note in scene.report.notes)


@pytest.mark.parametrize(("method", "halfway"), [("LINEAR", 1.5), ("STEP", 1.0), ("CUBICSPLINE", 1.5)])
def test_interpolations(tmp_path: Path, method: str, halfway: float) -> None:
    maker = Maker()
    node = maker.triangle()
    values = np.array([[0, 0, 0], [1, 0, 0], [2, 0, 0]], float)
    if method == "CUBICSPLINE":
        values = np.repeat(values, 3, axis=0)
        values[::3], values[2::3] = 50, -50  # tangents
    animate(maker, node, "translation", [0, 1, 2], values, method)
    scene = loaded(maker, tmp_path)
    (instance,) = scene.instances
    assert instance.motion is not None
    assert instance.motion.displacement(1.5)[0, 3] == pytest.approx(halfway)
    assert any("Cubic-spline" in note for note in scene.report.notes) == (method == "CUBICSPLINE")


def test_what_is_left_out_is_told(tmp_path: Path) -> None:
    maker = Maker()
    node, other = maker.triangle(), maker.node(matrix=np.eye(4).ravel().tolist())
    animate(maker, node, "translation", [0, 1], [[0, 0, 0], [1, 0, 0]])
    animate(maker, node, "scale", [0, 1], [[1, 1, 1], [2, 2, 2]])
    animate(maker, other, "translation", [0, 1], [[0, 0, 0], [1, 0, 0]])
    maker.json["animations"].append({"channels": [], "samplers": []})
    notes = " ".join(loaded(maker, tmp_path).report.notes)
    for words in ("Of 2 animations in the file, only the first one plays", "left out: nodes given by a matrix, scale"):
        assert words in notes


def test_what_no_matrix_leads_back_from_stands_still(tmp_path: Path) -> None:
    maker = Maker()
    node = maker.triangle()
    maker.json["nodes"][node]["scale"] = [1, 1, 0]
    animate(maker, node, "translation", [0, 1], [[3, 0, 0], [1, 0, 0]])
    scene = loaded(maker, tmp_path)
    assert scene.instances[0].motion is None
    assert scene.instances[0].transform[0, 3] == 3.0
    assert any("scaled flat" in note for note in scene.report.notes)


def test_a_chain_of_endless_joints_is_followed_so_far(tmp_path: Path) -> None:
    maker = Maker()
    mesh = maker.mesh(maker.primitive(maker.accessor(CORNERS)))
    below = maker.node(root=False, mesh=mesh)
    for depth in range(500):
        below = maker.node(root=depth == 499, children=[below], translation=[0, 0, 0])
        animate(maker, below, "translation", [0, 1], [[0, 0, 0], [1, 0, 0]])
    scene = loaded(maker, tmp_path)
    (instance,) = scene.instances
    assert instance.motion is not None
    assert instance.motion.displacement(0.5)[0, 3] == 0.5 * MAX_JOINTS
    assert any(f"below {MAX_JOINTS} others" in note for note in scene.report.notes)


def test_only_so_many_objects_move(tmp_path: Path) -> None:
    maker = Maker()
    mesh = maker.mesh(maker.primitive(maker.accessor(CORNERS)))
    for _ in range(MAX_MOVING + 3):
        animate(maker, maker.node(mesh=mesh), "translation", [0, 1], [[0, 0, 0], [1, 0, 0]])
    scene = loaded(maker, tmp_path)
    assert len(flatten(scene).moving) == MAX_MOVING
    assert any(f"only the first {MAX_MOVING} move" in note for note in scene.report.notes)


def test_an_animation_without_time_is_a_pose(tmp_path: Path) -> None:
    maker = Maker()
    animate(maker, maker.triangle(), "translation", [0], [[3, 0, 0]])
    (instance,) = loaded(maker, tmp_path).instances
    assert instance.transform[0, 3] == 3.0
    if instance.motion:
        np.testing.assert_array_equal(instance.motion.displacement(0.37), np.eye(4))


def nan_key(maker: Maker) -> None:
    animate(maker, 0, "translation", [0, 1], [[0, 0, 0], [np.nan, 0, 0]])


def endless_time(maker: Maker) -> None:
    animate(maker, 0, "translation", [0, np.inf], [[0, 0, 0], [1, 0, 0]])


def unsorted_times(maker: Maker) -> None:
    animate(maker, 0, "translation", [0, 2, 1], np.zeros((3, 3)))


def negative_time(maker: Maker) -> None:
    animate(maker, 0, "translation", [-1, 1], np.zeros((2, 3)))


def too_few_values(maker: Maker) -> None:
    animate(maker, 0, "translation", [0, 1, 2], np.zeros((2, 3)))


def no_keys(maker: Maker) -> None:
    animate(maker, 0, "translation", np.zeros(0), np.zeros((0, 3)))


def flat_rotation(maker: Maker) -> None:
    animate(maker, 0, "rotation", [0, 1], np.zeros((2, 3)))


def missing_accessor(maker: Maker) -> None:
    animate(maker, 0, "translation", [0, 1], np.zeros((2, 3)), input=99)


def missing_node(maker: Maker) -> None:
    animate(maker, 99, "translation", [0, 1], np.zeros((2, 3)))


def missing_sampler(maker: Maker) -> None:
    nan_key(maker)
    maker.json["animations"][0]["samplers"] = []


def unknown_method(maker: Maker) -> None:
    animate(maker, 0, "translation", [0, 1], np.zeros((2, 3)), "BOUNCE")


def countless_keys(maker: Maker) -> None:
    animate(maker, 0, "translation", [0, 1], np.zeros((2, 3)))
    maker.json["accessors"][-1] |= {"count": 2**40}


def far_flight(maker: Maker) -> None:
    animate(maker, 0, "translation", [0, 1], [[0, 0, 0], [1e30, 0, 0]])


def far_arm(maker: Maker) -> None:
    maker.json["nodes"][0] |= {"scale": [1e200] * 3, "translation": [1e300, 0, 0]}
    animate(maker, 0, "rotation", [0, 1], [IDENTITY, spin(1, 90)])


def wrong_kind(maker: Maker) -> None:
    maker.json["animations"] = {"channels": 3}


def cycle(maker: Maker) -> None:
    animate(maker, 0, "translation", [0, 1], np.zeros((2, 3)))
    maker.json["nodes"][0]["children"] = [0]


HOSTILE: dict[Callable[[Maker], None], str] = {
    nan_key: "not a finite number",
    endless_time: "not a finite number",
    unsorted_times: "not in order",
    negative_time: "negative or not in order",
    too_few_values: "3 key times but 2 values",
    no_keys: "0 keys",
    flat_rotation: "3 components",
    missing_accessor: "accessors[99]",
    missing_node: "nodes[99]",
    missing_sampler: "does not follow",
    unknown_method: "'BOUNCE'",
    countless_keys: "claims 1099511627776",
    far_flight: "too far from the origin",
    far_arm: "too far from the origin",
    wrong_kind: "does not follow",
    cycle: "no tree",
}


@pytest.mark.parametrize("damage", HOSTILE, ids=lambda d: d.__name__)
def test_a_hostile_animation_is_one_sentence(tmp_path: Path, damage: Callable[[Maker], None]) -> None:
    maker = Maker()
    maker.triangle()
    damage(maker)
    path = maker.write(tmp_path / "bad.glb")
    with pytest.raises(UserError) as error:
        load_scene(path)
    message = str(error.value)
    assert HOSTILE[damage] in message
    assert str(path) in message
    assert "\n" not in message
