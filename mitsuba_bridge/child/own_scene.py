"""Somebody's Mitsuba file: what it says, node by node, and the scene that it is; runs in the child only.

Mitsuba itself parses it: includes, defaults, references, old versions. Nothing is optimised: since 3.7 loading merges
meshes that share a material, and their names with them.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

Array = NDArray[Any]
NEAR_AND_FAR = 1e-5, 1e9
"""Of the camera: nothing is cut off."""
IN_DICT = "dictionary node "
"""What Mitsuba calls places in a dict, then in quotes the names on the way."""
MESH = ("vertices", "faces", "normals", "uv")
MESHES = ("obj", "ply", "serialized")
"""Shapes whose triangles are read by Mitsuba."""


OBJECTS: dict[str, Callable[[Any], Any]] = {
    "Transform": lambda value: mi.ScalarTransform4d(np.array(value)),
    "Color": lambda value: mi.ScalarColor3d(*value),
}
"""Values of a dict that are Mitsuba's own, by the kinds that they crossed with."""


def _dictionary(entries: dict[str, Any]) -> dict[str, Any]:
    """A dict of `mi.load_dict` from what crossed."""
    return {name: _dictionary(entry) if isinstance(entry, dict) else _object(*entry) for name, entry in entries.items()}


def _object(kind: str, value: Any) -> Any:
    return OBJECTS[kind](value) if kind in OBJECTS else value


def _parsed(source: dict[str, Any]) -> tuple[Any, Any]:
    """A file's, or a dict's, configuration and state, its references resolved."""
    config = mi.parser.ParserConfig(str(mi.variant()))
    config.merge_meshes = config.merge_equivalent = False
    if source["words"]:
        state = mi.parser.parse_dict(config, _dictionary(json.loads(source["words"])))
    else:
        resolver: Any = mi.file_resolver  # its stub knows no type
        resolver().prepend(str(Path(source["file"]).parent))  # what the file names stands beside it
        state = mi.parser.parse_file(config, source["file"])
    mi.parser.transform_upgrade(config, state)
    mi.parser.transform_resolve_references(config, state)
    return config, state


def _value(props: Any, name: str) -> Any:
    """A property as JSON: [kind, value]."""
    kind = str(props.type(name)).rpartition(".")[2]
    value = props[name]
    if kind == "ResolvedReference":
        return [kind, int(str(value).partition("[")[2].rstrip("]"))]
    if kind == "Transform":
        return [kind, np.array(value.matrix, dtype=np.float64).tolist()]
    if kind in ("Vector", "Color"):
        return [kind, np.array(value, dtype=np.float64).ravel().tolist()]
    if kind == "Spectrum":
        words = str(value)
        uniform = words.partition("uniform=")[2].partition("]")[0]
        return [kind, float(uniform) if uniform else None]
    return [kind, value if isinstance(value, bool | int | float | str) else str(value)]


def _place(state: Any, node: Any) -> str:
    """FILE:LINE, or dict.NAME.NAME, as far as Mitsuba knows."""
    words = str(mi.parser.file_location(state, node))
    if words.startswith(IN_DICT):
        return f"dict.{words[len(IN_DICT) :].strip(chr(34))}".replace(".root", "")
    file, _, rest = words.partition(" (line ")
    return f"{file}:{rest.partition(',')[0]}" if rest else words


def parse_own(job: dict[str, Any], folder: Path, progress: Callable[[int, int], None]) -> dict[str, Array]:
    """``told``: of each file its nodes, or why there are none, as JSON in bytes; and the meshes of its nodes.

    ``vertices{f}-{k}`` (3, n), ``faces{f}-{k}`` (3, m), ``normals{f}-{k}`` and ``uv{f}-{k}`` (2, n) are those of node k
    of file f, ``texels{f}-{k}`` (3, h, w) those of its picture.
    """
    told: list[dict[str, Any]] = []
    arrays: dict[str, Array] = {}
    for number, source in enumerate(job["sources"]):
        try:
            nodes, loaded, unbuilt = _nodes(source)
        except (RuntimeError, ValueError, TypeError) as error:
            told.append({"error": str(error)})
            continue
        told.append({"nodes": nodes, "unbuilt": unbuilt})
        for index, named in loaded.items():
            arrays |= {f"{what}{number}-{index}": array for what, array in named.items()}
    return {"told": np.frombuffer(json.dumps(told).encode(), dtype=np.uint8), **arrays}


def _nodes(source: dict[str, Any]) -> tuple[list[dict[str, Any]], dict[int, dict[str, Array]], str]:
    """What a file says, node by node, what is loaded of it by the numbers of the nodes, and what stops it."""
    config, state = _parsed(source)
    nodes, loaded = [], {}
    for index, node in enumerate(state.nodes):
        props = node.props
        nodes.append(
            {
                "type": str(node.type).rpartition(".")[2],
                "plugin": props.plugin_name(),
                "id": props.id(),
                "place": _place(state, node),
                "properties": {name: _value(props, name) for name in _names(props)},
            }
        )
        if props.plugin_name() in MESHES:
            loaded[index] = _mesh(props)
        if props.plugin_name() == "bitmap" and "filename" in _names(props):
            loaded[index] = {"texels": _texels(props)}
    try:
        mi.parser.instantiate(config, state)
    except (RuntimeError, ValueError, TypeError) as error:
        return nodes, loaded, str(error)
    return nodes, loaded, ""


def _names(props: Any) -> list[str]:
    return [str(name) for name in props.property_names()]


def _mesh(props: Any) -> dict[str, Array]:
    """`MESH` of one shape, in the world, by itself; no shading normals if it is faceted."""
    words: dict[str, Any] = {"type": props.plugin_name()}
    for name in _names(props):
        if not str(props.type(name)).endswith("Reference") and name != "flip_normals":
            words[name] = props[name] if name != "to_world" else mi.ScalarTransform4f(props[name].matrix)
    params = mi.traverse(mi.load_dict(words))
    names = ("vertex_positions", "faces", "vertex_normals", "vertex_texcoords")
    rows = (3, 3, 3, 2)
    return {
        what: np.array(params[name], dtype=np.float64).reshape(-1, count).T
        for what, name, count in zip(MESH, names, rows, strict=True)
    }


def _texels(props: Any) -> Array:
    """A picture's, linear (3, h, w), as Mitsuba's bitmap decodes them."""
    resolver: Any = mi.file_resolver
    picture = mi.Bitmap(str(resolver().resolve(props["filename"])))
    if "raw" in _names(props) and props["raw"]:
        picture.set_srgb_gamma(False)
    linear = picture.convert(mi.Bitmap.PixelFormat.RGB, mi.Struct.Type.Float32, False)
    return np.array(linear, dtype=np.float64).transpose(2, 0, 1)


def _black(state: Any) -> int:
    """The number of a new node, a surface that reflects nothing."""
    node = mi.parser.SceneNode()
    node.type = mi.ObjectType.BSDF
    node.props = mi.Properties("diffuse")
    node.props.set_id("black")
    node.props["reflectance"] = mi.ScalarColor3f(0.0)
    state.nodes.append(node)
    return len(state.nodes) - 1


def own_scene(own: dict[str, Any], size: tuple[int, int]) -> Any:
    """The scene of a file, its lights named ``light{k}`` in the order of ``own["lights"]`` (numbers of nodes).

    Emitting shapes are made black, as reflectors, and the film has the size that is asked for.
    """
    config, state = _parsed(own)
    config.unused_properties = config.unused_parameters = mi.LogLevel.Debug
    nodes = state.nodes
    black = _black(state)
    for number, index in enumerate(own["lights"]):
        node = nodes[index]
        node.props.set_id(f"light{number}")
        for name in _names(node.props) if str(node.type).endswith("Shape") else ():
            kind, value = _value(node.props, name)
            if kind == "ResolvedReference" and str(nodes[value].type).endswith("BSDF"):
                node.props[name] = mi.Properties.ResolvedReference(black)
        nodes[index] = node
    for index, node in enumerate(nodes):
        if str(node.type).endswith("Film"):
            node.props["width"], node.props["height"] = size
            nodes[index] = node
        if node.props.plugin_name() == "perspective":
            node.props["near_clip"], node.props["far_clip"] = NEAR_AND_FAR
            nodes[index] = node
    return mi.parser.instantiate(config, state)
