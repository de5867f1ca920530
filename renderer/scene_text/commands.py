"""Which commands the scene text format has, and how their arguments are read."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

from nusselt.renderer.errors import InputError
from nusselt.renderer.lights import LIGHTS, Light
from nusselt.renderer.lights.text import from_numbers
from nusselt.renderer.lobes import LOBES, Lobe
from nusselt.renderer.lobes.protocol import Parameter
from nusselt.renderer.validation import colour

from .state import SceneState

NUMBER = r"[+-]?+(?:\d++\.?+\d*+|\.\d++)(?:[eE][+-]?+\d++)?+"
_FLOAT = re.compile(NUMBER, re.ASCII)
_INTEGER = re.compile(r"[+-]?\d{1,18}", re.ASCII)
_NORMALS = "flat faces: shading normals are not supported"
_SHAPES = "sphere, tri or mesh: no other shape is supported"
_KNOWN = [kind.TEXT.command for kind in LIGHTS]
_SOURCES = f"{', '.join(_KNOWN[:-1])} or {_KNOWN[-1]}: no other source is supported"
REFUSED = {
    **dict.fromkeys(("vertexnormal", "trinormal", "computeVertexNormals"), _NORMALS),
    "texture": "one colour for each surface and light: textures are not supported",
    **dict.fromkeys(("spot", "envmap", "area"), _SOURCES),
    **dict.fromkeys(("box", "cube", "cylinder", "cone", "plane", "quad", "torus"), _SHAPES),
    "background": "sky r g b: without one the background is black",
}
"""Commands of other renderers of this format, and what is accepted in their place."""


def _number(argument: str, token: str) -> float:
    value = float(token) if _FLOAT.fullmatch(token) else math.nan
    if not math.isfinite(value):
        raise InputError(argument, token, "a finite decimal number")
    return value


def _whole(argument: str, token: str) -> int:
    if not _INTEGER.fullmatch(token):
        raise InputError(argument, token, "a whole number of at most 18 digits")
    return int(token)


def _word(argument: str, token: str) -> str:
    return token


def _one_of(*words: str) -> Callable[[str, str], str]:
    def read(argument: str, token: str) -> str:
        if token not in words:
            raise InputError(argument, token, " or ".join(words))
        return token

    return read


@dataclass(frozen=True)
class Command:
    """A command's action, its reader of one argument, and its arguments' names."""

    act: Callable[..., None]
    read: Callable[[str, str], Any]
    arguments: tuple[str, ...]

    def values(self, name: str, tokens: Sequence[str]) -> list[Any]:
        """The arguments, none missing and none spare."""
        names, given = self.arguments, len(tokens)
        accepted = f"{len(names)} arguments: {' '.join(names)}" if names else "no argument"
        if given < len(names):
            raise InputError(f"{name} {names[given]}", "missing", accepted)
        if given > len(names):
            raise InputError(f"{name} spare argument", tokens[len(names)], accepted)
        return [self.read(f"{name} {what}", token) for what, token in zip(names, tokens, strict=True)]


def _command(act: Callable[..., None], read: Callable[[str, str], Any], arguments: str = "") -> Command:
    """``from:xyz fov`` stands for the arguments from.x, from.y, from.z and fov."""
    names: list[str] = []
    for argument in arguments.split():
        name, _, parts = argument.partition(":")
        names += [f"{name}.{part}" for part in parts] if parts else [name]
    return Command(act, read, tuple(names))


def _ignored(name: str, read: Callable[[str, str], Any], arguments: str, why: str) -> dict[str, Command]:
    def act(state: SceneState, *values: Any) -> None:
        state.warn(f"{name} ignored: {why}", state.place)

    return {name: _command(act, read, arguments)}


def _light_command(kind: type[Light]) -> Command:
    def act(state: SceneState, *values: float) -> None:
        if kind.TEXT.of_surface:
            colour(f"{kind.TEXT.command} radiance", values)  # its surface, and so the light, comes lines later
            state.lit(partial(from_numbers, kind, kind.TEXT, values), any(values))
        else:
            state.light(from_numbers(kind, kind.TEXT, values))

    return _command(act, _number, kind.TEXT.arguments)


def lobe_commands(kind: type[Lobe]) -> dict[str, Command]:
    """The commands that set the parameters of a kind of lobe."""

    def command(parameter: Parameter) -> Command:
        def act(state: SceneState, *values: float) -> None:
            state.parameter(parameter.name, values if parameter.is_colour else values[0])

        return _command(act, _number, parameter.arguments)

    return {parameter.name: command(parameter) for parameter in kind.PARAMETERS}


COMMANDS = {
    "size": _command(SceneState.size, _whole, "width height"),
    "output": _command(SceneState.output, _word, "file"),
    "camera": _command(SceneState.camera, _number, "from:xyz at:xyz up:xyz fov"),
    "integrator": _command(SceneState.integrator, _word, "name"),
    "lightsamples": _command(SceneState.lightsamples, _whole, "count"),
    "lightstratify": _command(SceneState.lightstratify, _word, "switch"),
    "spp": _command(SceneState.spp, _whole, "count"),
    "maxdepth": _command(SceneState.accepted, _whole, "count"),
    "maxverts": _command(SceneState.accepted, _whole, "count"),
    "maxvertnorms": _command(SceneState.accepted, _whole, "count"),
    **_ignored(
        "nexteventestimation",
        _one_of("on", "off", "mis"),
        "switch",
        "it says how paths find the lights, not how bright they are",
    ),
    **_ignored("russianroulette", _one_of("on", "off"), "switch", "it ends paths, and direct light has none to end"),
    **_ignored(
        "importancesampling",
        _one_of("hemisphere", "cosine", "brdf"),
        "method",
        "it changes a path's noise, not its mean",
    ),
    "gamma": _command(SceneState.gamma, _number, "exponent"),
    "vertex": _command(SceneState.vertex, _number, "x y z"),
    "tri": _command(SceneState.tri, _whole, "i j k"),
    "mesh": _command(SceneState.mesh, _word, "file"),
    "sphere": _command(SceneState.sphere, _number, "center:xyz radius"),
    "translate": _command(SceneState.translate, _number, "x y z"),
    "rotate": _command(SceneState.rotate, _number, "axis:xyz degrees"),
    "scale": _command(SceneState.scale, _number, "x y z"),
    "pushTransform": _command(SceneState.push, _word),
    "popTransform": _command(SceneState.pop, _word),
    **{kind.TEXT.command: _light_command(kind) for kind in LIGHTS},
    "sensor": _command(SceneState.sensor, _number, "at:xyz normal:xyz"),
    "sensorGrid": _command(SceneState.sensor_grid, _number, "corner:xyz ab:xyz ac:xyz normal:xyz nab nac"),
    "expect": _command(SceneState.expect, _number, "irradiance:rgb percent"),
    "expectPixel": _command(SceneState.expect_pixel, _number, "x y radiance:rgb percent"),
    "brdf": _command(SceneState.brdf, _word, "name"),
    **_ignored("roughness", _number, "alpha", "brdf ggx alone has one"),
    "attenuation": _command(SceneState.attenuation, _number, "constant linear quadratic"),
    "ambient": _command(SceneState.ambient, _number, "r g b"),
    "emission": _command(SceneState.emission, _number, "r g b"),
    **{name: command for kind in LOBES for name, command in lobe_commands(kind).items()},
}
