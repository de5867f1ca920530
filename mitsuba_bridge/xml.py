"""A description as Mitsuba XML text; needs no Mitsuba.

Matrices are written with 17 digits, and not taken apart: Mitsuba's own writer decomposes them and loses bits.
"""

from __future__ import annotations

from typing import Any
from xml.sax.saxutils import quoteattr

from .description import ROBUST, Description
from .lights import COLOURS, SHAPES

Lines = list[str]


def _number(value: float) -> str:
    return repr(float(value))


def _tag(kind: str, name: str, value: str) -> str:
    return f"<{kind} name={quoteattr(name)} value={quoteattr(value)}/>"


def _rgb(name: str, value: list[float]) -> str:
    return _tag("rgb", name, " ".join(map(_number, value)))


def _matrix(rows: list[list[float]]) -> str:
    values = " ".join(_number(v) for row in rows for v in row)
    return f'<transform name="to_world"><matrix value={quoteattr(values)}/></transform>'


def _point(kind: str, name: str, value: list[float]) -> str:
    x, y, z = (quoteattr(_number(v)) for v in value)
    return f"<{kind} name={quoteattr(name)} x={x} y={y} z={z}/>"


def _bsdf(bsdf: dict[str, Any], number: int, two_sided: bool) -> Lines:
    name = f"id={quoteattr(f'bsdf{number}')}"
    inside = [
        _tag("float", key, _number(value)) if isinstance(value, float) else _rgb(key, value)
        for key, value in bsdf.items()
        if key != "kind"
    ]
    kind = quoteattr(bsdf["kind"])
    if two_sided:
        return [f'<bsdf type="twosided" {name}>', f"<bsdf type={kind}>", *inside, "</bsdf>", "</bsdf>"]
    return [f"<bsdf type={kind} {name}>", *inside, "</bsdf>"]


BLACK = ['<bsdf type="diffuse"><rgb name="reflectance" value="0 0 0"/></bsdf>']


def _shape(shape: dict[str, Any], number: int) -> Lines:
    if shape["kind"] == "ply":
        inside = [
            _tag("string", "filename", shape["file"]),
            _tag("boolean", "face_normals", str(not shape["smooth"]).lower()),
        ]
    else:
        inside = [_point("point", "center", shape["center"]), _tag("float", "radius", _number(shape["radius"]))]
    bsdf = shape["bsdf"]
    surface = f'<ref id="bsdf{bsdf}"/>'
    return [f"<shape type={quoteattr(shape['kind'])} id={quoteattr(f'shape{number}')}>", *inside, surface, "</shape>"]


def _light(light: dict[str, Any], number: int) -> Lines:
    name, kind = f"id={quoteattr(f'light{number}')}", quoteattr(light["kind"])
    inside = []
    for key, value in light.items():
        if key == "to_world":
            inside.append(_matrix(value))
        elif key == "file":
            inside += [_tag("string", "filename", value), _tag("boolean", "face_normals", "true")]
        elif key == "radiance" and light["kind"] in SHAPES:
            continue
        elif key in COLOURS:
            inside.append(_rgb(key, value))
        elif key in ("position", "center", "direction", "normal"):
            inside.append(_point("point" if key in ("position", "center") else "vector", key, value))
        elif key not in ("kind", "body"):
            inside.append(_tag("float", key, _number(value)))
    if light["kind"] in SHAPES:
        emitter = ['<emitter type="area">', _rgb("radiance", light["radiance"]), "</emitter>"]
        return [f"<shape type={kind} {name}>", *inside, *BLACK, *emitter, "</shape>"]
    return [f"<emitter type={kind} {name}>", *inside, "</emitter>"]


def _sensor(camera: dict[str, Any], samples: int) -> Lines:
    def triple(name: str) -> str:
        return quoteattr(", ".join(map(_number, camera[name])))

    look_at = f"<lookat origin={triple('origin')} target={triple('target')} up={triple('up')}/>"
    return [
        '<sensor type="perspective">',
        _tag("float", "fov", _number(camera["fov"])),
        _tag("string", "fov_axis", "y"),
        _tag("float", "near_clip", _number(camera["near"])),
        _tag("float", "far_clip", _number(camera["far"])),
        f'<transform name="to_world">{look_at}</transform>',
        f'<sampler type="independent"><integer name="sample_count" value="{samples}"/></sampler>',
        '<film type="hdrfilm">',
        _tag("integer", "width", str(camera["width"])),
        _tag("integer", "height", str(camera["height"])),
        _tag("string", "component_format", "float32"),
        _tag("string", "pixel_format", "rgb"),
        '<rfilter type="box"/>',
        "</film>",
        "</sensor>",
    ]


def to_xml(description: Description, samples: int = 64) -> str:
    """The whole scene, all lights on, with ``samples`` a pixel."""
    if any(max(shape["emission"]) > 0 for shape in description.shapes):
        remark = ["<!-- Emission of ordinary surfaces is seen and lights nothing; it is not in this file. -->"]
    else:
        remark = []
    direct = [_tag("integer", "emitter_samples", "1"), _tag("integer", "bsdf_samples", "0")]
    lines = [
        '<scene version="3.0.0">',
        *remark,
        _tag("boolean", ROBUST, "true"),
        '<integrator type="direct">',
        *direct,
        "</integrator>",
        *_sensor(description.camera, samples),
    ]
    for number, bsdf in enumerate(description.bsdfs):
        lines += _bsdf(bsdf, number, description.two_sided)
    for number, shape in enumerate(description.shapes):
        lines += _shape(shape, number)
    for number, light in enumerate(description.lights):
        lines += _light(light, number)
    return "\n".join([*lines, "</scene>", ""])
