"""A description as the dictionary Mitsuba loads; imported in the child only."""

from __future__ import annotations

import sys
from collections.abc import Container
from pathlib import Path
from typing import Any

import mitsuba as mi

from nusselt.mitsuba_bridge.description import ROBUST
from nusselt.mitsuba_bridge.lights import COLOURS, SHAPES

BLACK = {"type": "diffuse", "reflectance": {"type": "rgb", "value": [0.0, 0.0, 0.0]}}


def _rgb(value: list[float]) -> dict[str, Any]:
    return {"type": "rgb", "value": [float(v) for v in value]}


def _matrix(rows: list[list[float]]) -> Any:
    return mi.ScalarTransform4f(rows)


def bsdf_dict(bsdf: dict[str, Any], two_sided: bool) -> dict[str, Any]:
    """One surface."""
    found: dict[str, Any] = {"type": bsdf["kind"]}
    for key, value in bsdf.items():
        if key != "kind":
            found[key] = float(value) if isinstance(value, int | float) else _rgb(value)
    return {"type": "twosided", "bsdf": found} if two_sided else found


def light_dict(light: dict[str, Any], folder: Path, lit: bool) -> dict[str, Any] | None:
    """One light; one that is not lit stays as a black blocker if it has a body in the scene."""
    if not (lit or light["body"]):
        return None
    entry: dict[str, Any] = {"type": light["kind"]}
    for key, value in light.items():
        if key == "to_world":
            entry[key] = _matrix(value)
        elif key in COLOURS:
            entry[key] = _rgb(value)
        elif key == "file":
            entry |= {"filename": str(folder / value), "face_normals": True}
        elif key not in ("kind", "body"):
            entry[key] = value
    if light["kind"] not in SHAPES:
        return entry
    emitter = {"type": "area", "radiance": entry.pop("radiance")}
    return entry | {"bsdf": BLACK} | ({"emitter": emitter} if lit else {})


def sensor_dict(camera: dict[str, Any]) -> dict[str, Any]:
    """The camera, with a box-filtered float32 film of its own size."""
    look_at = mi.ScalarTransform4f().look_at(camera["origin"], camera["target"], camera["up"])
    return {
        "type": "perspective",
        "fov": float(camera["fov"]),
        "fov_axis": "y",
        "near_clip": float(camera["near"]),
        "far_clip": float(camera["far"]),
        "to_world": look_at,
        "film": {
            "type": "hdrfilm",
            "width": camera["width"],
            "height": camera["height"],
            "rfilter": {"type": "box"},
            "component_format": "float32",
            "pixel_format": "rgb",
        },
    }


EVERY = range(sys.maxsize)
"""All lights on."""


def scene_dict(description: dict[str, Any], folder: Path, lit: Container[int], robust: bool = True) -> dict[str, Any]:
    """The scene with some lights switched on, by their numbers.

    Parameters
    ----------
    robust : bool
        Embree's robust mode. Without it (Mitsuba's default) up to a fifth of the rays that meet an edge shared by
        two triangles pass between them; with it no such ray was lost, and one in 140 of those through a vertex.
    """
    found: dict[str, Any] = {"type": "scene", "sensor": sensor_dict(description["camera"]), ROBUST: robust}
    for number, shape in enumerate(description["shapes"]):
        bsdf = bsdf_dict(description["bsdfs"][shape["bsdf"]], description["two_sided"])
        entry: dict[str, Any] = {"type": shape["kind"], "bsdf": bsdf}
        if shape["kind"] == "ply":
            entry |= {"filename": str(folder / shape["file"]), "face_normals": not shape["smooth"]}
        else:
            entry |= {"center": shape["center"], "radius": shape["radius"]}
        found[f"shape{number}"] = entry
    for number, light in enumerate(description["lights"]):
        body = light_dict(light, folder, number in lit)
        if body is not None:
            found[f"light{number}"] = body
    return found
