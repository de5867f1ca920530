"""What a file says of itself reaches the row: layers that are named, curves that chunks name."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from brought import ROOM, honest, judged
from click.testing import CliRunner
from test_bring_files import chunk

import nusselt
from nusselt.experiments.cli.main import main
from nusselt.experiments.external import comparison
from nusselt.experiments.external.diagnosis.diagnose import Diagnosis
from nusselt.experiments.images.formats.exr import write_channels
from nusselt.experiments.images.write import write_image
from nusselt.renderer.scene_text import write_scene


@pytest.fixture(autouse=True)
def undiagnosed(monkeypatch):
    monkeypatch.setattr(comparison, "diagnose", lambda *_: Diagnosis(()))


def layered(path: Path, **layers: np.ndarray) -> Path:
    """Images (h, w, 3) as layers of one file."""
    channels = {f"{name}.{end}": image[..., k] for name, image in layers.items() for k, end in enumerate("RGB")}
    write_channels(path, channels)
    return path


def test_a_layer_is_named_on_the_command_line_and_in_python(tmp_path):
    image = honest(ROOM, 3)
    path = layered(tmp_path / "a.exr", wrong=1.2 * image, right=image)
    (tmp_path / "room.test").write_text(write_scene(ROOM))
    verdicts = {}
    for layer in ("right", "wrong"):
        words = ["check", str(tmp_path / "room.test"), f"{path}:{layer}", "--margin", "0.05", "--json", "-"]
        told = CliRunner().invoke(main, words)
        (row,) = json.loads(told.stdout)["rows"]
        assert row["brought"] == [f"{path}:{layer}"]
        assert f"its layer {layer} is taken" in row["warnings"]
        assert f"{path}:{layer}" in row["command"]
        assert nusselt.check(ROOM, images=f"{path}:{layer}", margin=0.05).verdict == row["verdict"]
        verdicts[layer] = row["verdict"]
    assert verdicts == {"right": "agrees", "wrong": "differs"}
    told = CliRunner().invoke(main, ["check", str(tmp_path / "room.test"), str(path)])
    assert told.exit_code == 2
    assert "2 layers: expected one of them, named as a.exr:LAYER: right, wrong" in told.stderr


@pytest.mark.parametrize(("transfer", "quoted"), [("linear", True), ("srgb", False)])
def test_a_curve_that_the_file_names_is_quoted_where_none_is_given(tmp_path, transfer, quoted):
    path = tmp_path / "a.png"
    write_image(path, honest(ROOM, 3).transpose(2, 0, 1))
    data = path.read_bytes()
    path.write_bytes(data[:33] + chunk(b"sRGB", b"\0") + data[33:])
    row = nusselt.check(ROOM, images=path, transfer=transfer).row
    note = "its sRGB chunk says sRGB (--transfer srgb): levels are taken for linear"
    assert (note in row["warnings"]) == quoted


def test_what_is_undone_is_said_in_the_row(tmp_path):
    image = honest(ROOM, 3)
    path = tmp_path / "a.hdr"
    head = "#?RADIANCE\nEXPOSURE=2\nFORMAT=32-bit_rle_rgbe\n\n-Y {} +X {}\n".format(*image.shape[:2])
    exponent = np.frexp(np.maximum(2 * image.max(axis=2), 1e-30))[1]
    mantissas = np.floor(2 * image * np.exp2(8.0 - exponent)[..., None])
    rgbe = np.dstack((mantissas, np.where(image.max(axis=2) > 0, exponent + 128, 0))).astype(np.uint8)
    path.write_bytes(head.encode() + rgbe.tobytes())
    row = judged(ROOM, [path], margin=0.05)
    assert row["verdict"] == "agrees", row["reason"]
    assert "its EXPOSURE 2 is divided out" in row["warnings"]
