"""The tables of the scene text format and of mesh files say what the readers do."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from places import ROOT

from nusselt.renderer.errors import InputError
from nusselt.renderer.lights import QuadLight
from nusselt.renderer.mesh_files import obj, ply_header, read_mesh_file
from nusselt.renderer.scene_text import parse_scene
from nusselt.renderer.scene_text.commands import COMMANDS, REFUSED

SECTION = (ROOT / "docs" / "scenes.md").read_text(encoding="utf-8").split("## Scene files\n")[1].split("\n## ")[0]
ROWS = [row.split(" | ") for row in SECTION.splitlines() if row.startswith("| `")]
VIEW = "size 4 3\ncamera 0 0 4  0 0 0  0 1 0  45\n"


def arguments(words: list[str]) -> tuple[str, ...]:
    """``from.xyz fov`` as the reader names it: from.x, from.y, from.z, fov."""
    names: list[str] = []
    for word in words:
        name, _, parts = word.partition(".")
        names += [f"{name}.{part}" for part in parts] if parts else [name]
    return tuple(names)


def test_the_table_has_every_command_with_its_arguments() -> None:
    said = [text.split() for row in ROWS for text in re.findall("`([^`]*)`", row[0])]
    assert {name: arguments(words) for name, *words in said} == {n: c.arguments for n, c in COMMANDS.items()}
    assert len(said) == len(COMMANDS)


def test_what_is_refused_is_listed() -> None:
    listed = SECTION.split("refused by name:")[1].split("A word that")[0]
    assert set(re.findall("`([^` ]*)`", listed)) == set(REFUSED)


def test_the_tables_defaults_are_the_readers() -> None:
    defaults = {text.split()[0]: row[1] for row in ROWS for text in re.findall("`([^`]*)`", row[0])}
    scene = parse_scene(VIEW + "vertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\ntri 0 1 2\n")
    assert defaults["output"] == f"`{scene.output}`"
    assert defaults["integrator"] == f"`{scene.integrator}`"
    assert defaults["spp"] == str(scene.spp)
    assert defaults["lightsamples"] == str(scene.light_samples)
    assert defaults["lightstratify"] == ("`on`" if scene.stratify else "`off`")
    material = scene.meshes[0].material
    assert defaults["diffuse"] == defaults["emission"] == "0 0 0"
    assert max(*material.diffuse, *material.emission, *material.specular) == 0
    assert defaults["specular"] == f"0 0 0, {material.shininess:g}"
    for needed in ("size", "camera"):
        assert defaults[needed] == "needed"
        with pytest.raises(InputError, match=f"{needed} = missing"):
            parse_scene("".join(line + "\n" for line in VIEW.splitlines() if not line.startswith(needed)))


def test_the_drawing_shines_where_it_says() -> None:
    down = QuadLight((0, 0, 0), (0, 0, 1), (1, 0, 0), (1, 1, 1))
    up = QuadLight((0, 0, 0), (1, 0, 0), (0, 0, 1), (1, 1, 1))
    away = QuadLight((0, 0, 0), (0, -1, 0), (1, 0, 0), (1, 1, 1))
    assert [light.normal for light in (down, up, away)] == [(0, -1, 0), (0, 1, 0), (0, 0, -1)]


QUOTED = {
    "expected a finite decimal number": "vertex 1,5 0 0",
    "expected # before a comment": "vertex 0 0 0 // why",
    "expected three corners that span an area": "vertex 0 0 0\ntri 0 0 0",
    "expected three numbers": "v 0,5 0 0",
    "expected finite coordinates": "v nan 0 0\nf 1 1 1",
    "free-form surfaces are not supported": "surf 0 1 0 1 1",
    "expected one file": "call a.obj",
    "expected a PLY format, element or property": "ply\nformat ascii 1.0\nelement a 1\nproperty int64 b\nend_header\n",
    "expected vertex (x, y, z), and face or tristrips": "ply\nformat ascii 1.0\nelement vertex 0\nend_header\n",
}


@pytest.mark.parametrize("sentence", QUOTED)
def test_a_quoted_sentence_is_what_is_said(tmp_path: Path, sentence: str) -> None:
    text = QUOTED[sentence]
    path = tmp_path / ("a.ply" if text.startswith("ply") else "a.obj")
    path.write_text(text)
    with pytest.raises(InputError, match=re.escape(sentence)):
        parse_scene(VIEW + text) if "vertex" in text and path.suffix == ".obj" else read_mesh_file(path)


def test_every_quoted_sentence_is_tried() -> None:
    assert set(re.findall('"([^"]*)"', SECTION)) == set(QUOTED)


WAVEFRONT = """v vt vn vp cstype deg bmat step p l f fo curv curv2 surf parm trim hole scrv sp end con g s mg o bevel
c_interp d_interp lod usemap maplib usemtl mtllib shadow_obj trace_obj ctech stech call csh bsp bzp cdc cdp res"""
"""Every keyword of Object Files 3.0, the superseded ones too."""


def test_every_keyword_of_the_format_has_one_treatment() -> None:
    kinds = [*obj.LEFT_OUT, *obj.SILENT, *obj.REFUSED, b"v", b"f", b"fo"]
    assert len(set(kinds)) == len(kinds)
    assert {word.encode() for word in WAVEFRONT.split()} <= set(kinds)
    assert set(ply_header.FORMATS) == {"ascii", "binary_little_endian", "binary_big_endian"}
