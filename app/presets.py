"""Settings and a view as a small JSON file: {"view": "hybrid", "settings": {"rays.budget": 2.0}}.

It holds what differs from the defaults; what it lacks is at its default, so that a file from before a setting existed
means what it meant, and a view alone is a preset. Only focus distance and aperture belong to the viewpoint: a file
without them leaves them alone. What else it holds beside the two is for people; a report of `shot`, which holds both,
is a preset as well.
"""

from __future__ import annotations

import json
from argparse import Namespace
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from .errors import UserError
from .files import user_path
from .frame.pipeline import VIEWS
from .frame.targets import TARGETS
from .settings import Settings, from_dict, plain, put, walk

OF_VIEWPOINT = ("lens.focus_distance", "lens.aperture")
SUFFIX = ".json"


@dataclass(frozen=True)
class Preset:
    """What a preset file says."""

    view: str | None = None  # a view's or a target's name; None: it names none
    values: Mapping[str, Any] = field(default_factory=dict)  # by dotted path

    def applied(self, settings: Settings) -> Settings:
        """The settings that the preset means where `settings` have the focus and the aperture."""
        result, here = Settings(), {path: value for path, _, value in walk(settings)}
        for path, value in {**{path: here[path] for path in OF_VIEWPOINT}, **self.values}.items():
            result = put(result, path, value)
        return result


def without_viewpoint(settings: Settings) -> Settings:
    """With what belongs to a viewpoint at its default."""
    for path, leaf, _ in walk(settings):
        settings = put(settings, path, leaf.default) if path in OF_VIEWPOINT else settings
    return settings


def preset_of(settings: Settings, view: str | None = None) -> Preset:
    """What brings exactly these settings back from any others, focus and aperture among them."""
    return Preset(
        view, {path: value for path, leaf, value in walk(settings) if value != leaf.default or path in OF_VIEWPOINT}
    )


def write_preset(path: str | Path, preset: Preset, about: Mapping[str, Any] | None = None) -> None:
    """Write a preset file, whole or not at all, with what `about` tells people. Raises UserError."""
    from .picture import write_json

    view = {"view": preset.view} if preset.view else {}
    settings = {"settings": {name: plain(value) for name, value in preset.values.items()}}
    write_json(path, {**view, **settings, **({"about": about} if about else {})})


def read_preset(path: str | Path) -> Preset:
    """What a preset file says. Raises UserError naming the file, and the setting that is wrong."""
    path = user_path(path)
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise UserError(f"preset {path}: {error.strerror or error}") from None
    except (ValueError, RecursionError) as error:
        raise UserError(f"preset {path} is not JSON: {error}") from None
    content = content if isinstance(content, dict) else {}
    view = content.get("view")
    values = content.get("settings", {} if view is not None else None)  # some other file has neither
    if not isinstance(values, dict):
        raise UserError(f'preset {path} needs "settings", an object of settings by dotted name, or "view" alone')
    if view is not None and (not isinstance(view, str) or (view not in VIEWS and view not in TARGETS)):
        raise UserError(f"preset {path}: there is no view {view!r}; choose one of {', '.join(VIEWS)}")
    try:
        parsed = from_dict(values)
    except UserError as error:
        raise UserError(f"preset {path}: {error}") from None
    return Preset(view, {name: value for name, _, value in walk(parsed) if name in values})


def is_preset(path: str | Path) -> bool:
    """Whether the file can be read as one."""
    try:
        read_preset(path)
    except UserError:
        return False
    return True


def resolve(options: Namespace, default_view: str) -> None:
    """Read the preset that `--preset` names, if any, into `options.preset`, and let it choose the view where `--view`
    does not. Raises UserError.
    """
    options.preset = read_preset(options.preset) if options.preset else Preset()
    if "view" in options:
        options.view = options.view or options.preset.view or default_view
