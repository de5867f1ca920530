"""All that is known of an image's pixels, as the layers of one EXR file: `NAME.R`, `NAME.X`, `NAME.Y` for one number.

The image itself is in no layer (R, G, B), so that every viewer shows it first, and `check` reads it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from nusselt.experiments.files import replacing
from nusselt.experiments.images.formats.exr import write_channels
from nusselt.mitsuba_bridge.reference import Reference
from nusselt.renderer.camera.rays import pixel_centres
from nusselt.renderer.camera.view import look
from nusselt.renderer.errors import InputError
from nusselt.renderer.image import Image
from nusselt.renderer.lobes import Lambert
from nusselt.renderer.prepared import prepare
from nusselt.renderer.scene import Scene
from nusselt.renderer.tile import LIGHTS
from nusselt.renderer.vectors import Floats, column
from nusselt.renderer.words import count

from .visibility import visibility_layers

Layers = dict[str, np.ndarray[Any, Any]]
"""By name ("": the image), (1, h, w) or (3, h, w)."""
BLOCK = 1 << 18
"""Pixels whose rays are followed at once."""
ENDS = {"normal": "XYZ", "position": "XYZ", "depth": "Z"}
"""What channels of layers are called that are no colours and no plain numbers."""


def image_layers(image: Image) -> Layers:
    """Of an image: its mean, and its noise or bound where they are known; which pixels show lights or nothing; what the
    mean is the sum of: each light's share, and what shines and is none.
    """
    passes = len(image.pass_means)
    found = {"": image.mean, "emitter": image.emitter[None], "background": image.background[None]}
    if image.unjudged.any():
        found["unjudged"] = image.unjudged[None].astype(np.float64)
    if passes > 1:
        found["standardError"] = np.sqrt(image.variance / passes)
    if image.bound is not None:
        found["bound"] = image.bound[None]
    if image.light_means is not None:
        *lights, rest = image.light_means
        found |= {f"light{k}": share for k, share in enumerate(lights, 1)}
        found |= {"emission": rest} if rest.any() else {}
    return found


def all_layers(image: Image, scene: Scene) -> tuple[Layers, tuple[str, ...]]:
    """Of an image, what its pixels show and what reaches it; and which layers were left out, and why."""
    visible, left_out = visibility_layers(scene, is_exact=not image.variance.any())
    found = image_layers(image) | scene_layers(scene) | visible
    lights = len(scene.lights)
    if image.light_means is None:
        many = lights < 2 or lights > LIGHTS
        why = f"the scene has {count(lights, 'light')}" if many else "their shares were not kept apart"
        left_out = (f"light by light: {why}", *left_out)
    if "standardError" not in found:
        left_out = ("standard error: one pass, or nothing is random", *left_out)
    return found, left_out


def reference_layers(reference: Reference, z: Floats) -> Layers:
    """Of what it was compared with, and the difference (h, w) in standard errors."""
    found = {"reference": reference.mean, "referenceStandardError": reference.standard_error, "z": z[None]}
    return found | ({"holes": reference.holes[None]} if reference.holes.any() else {})


def scene_layers(scene: Scene) -> Layers:
    """What the ray through each pixel's centre hits, in float32: depth along the view, position, normal to the viewer,
    Lambert's albedo.

    Lengths are the scene's; nothing hit: depth inf, and 0.
    """
    near, geometry, _ = prepare(scene)
    moved = column(scene.camera.position) - column(near.camera.position)
    counts = {"depth": 1, "position": 3, "normal": 3, "albedo": 3}
    found = {name: np.zeros((n, scene.height, scene.width), dtype=np.float32) for name, n in counts.items()}
    step = max(1, BLOCK // scene.width)
    for rows in (range(y, min(y + step, scene.height)) for y in range(0, scene.height, step)):
        view = look(near, geometry, *pixel_centres(range(scene.width), rows))
        hit = view.hits.surface >= 0
        facing = (view.hits.normal * view.outgoing).sum(axis=0)
        albedo = np.zeros(view.hits.normal.shape)
        albedo[:, view.lit] = view.points.albedo(Lambert)
        seen = {
            "depth": view.hits.distance[None],  # rays are one long along the view
            "position": np.where(hit, view.hits.position + moved, 0),
            "normal": np.where(hit, np.where(facing < 0, -1, 1) * view.hits.normal, 0),
            "albedo": albedo,
        }
        for name, values in seen.items():
            found[name][:, rows.start : rows.stop] = values.reshape(-1, len(rows), scene.width)
    return found


def check_layered_name(path: Path, aovs: bool) -> None:
    """Refuse a name that layers cannot be written to.

    Raises
    ------
    InputError
    """
    if aovs and path.suffix.lower() != ".exr":
        raise InputError("aovs", str(path), "a name that ends in .exr: other formats have no layers")


def write_layers(path: Path, layers: Mapping[str, np.ndarray[Any, Any]], left_out: Sequence[str] = ()) -> None:
    """Write layers as one part of 32-bit channels; its header's ``comments`` say what was left out."""
    channels: Layers = {}
    for name, values in layers.items():
        ends = ENDS.get(name, "Y" if len(values) == 1 else "RGB")
        channels |= {f"{name}.{end}" if name else end: plane for end, plane in zip(ends, values, strict=True)}
    with replacing(path) as beside:
        write_channels(beside, channels, "; ".join(left_out) and f"left out: {'; '.join(left_out)}")
