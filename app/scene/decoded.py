"""The common result of every file decoder: a scene with meshes not yet checked."""

from __future__ import annotations

from dataclasses import dataclass, field

from .model import Environment, Image, Instance, Light, Material, SceneCamera
from .validate import RawMesh


@dataclass
class Decoded:
    """Same fields as Scene, plus the sentences for the load report; `meshes` still need `validate.clean`."""

    meshes: list[RawMesh]
    materials: list[Material]
    instances: list[Instance]
    images: list[Image] = field(default_factory=list)
    lights: list[Light] = field(default_factory=list)
    cameras: list[SceneCamera] = field(default_factory=list)
    environment: Environment = field(default_factory=Environment)
    notes: list[str] = field(default_factory=list)
