"""Every format moves values by its own rounding: a right image of each is not told to differ, a wrong light is."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import OpenEXR
import pytest
from brought import ROOM, honest, judged
from test_bring_files import hdr

from nusselt.experiments.external import comparison
from nusselt.experiments.external.diagnosis.diagnose import Diagnosis

LIGHT = ROOM.lights[0].colour
MARGIN = 0.05


@pytest.fixture(autouse=True)
def undiagnosed(monkeypatch):
    monkeypatch.setattr(comparison, "diagnose", lambda *_: Diagnosis(()))


def exr(path: Path, image: np.ndarray, compression: str, kind: type) -> Path:
    header = {"compression": getattr(OpenEXR, f"{compression}_COMPRESSION"), "type": OpenEXR.scanlineimage}
    with OpenEXR.File(header, {"RGB": np.ascontiguousarray(image.astype(kind))}) as file:
        file.write(str(path))
    return path


def rgbe(path: Path, image: np.ndarray) -> Path:
    path.write_bytes(hdr(image.transpose(2, 0, 1), True))
    return path


LOSSLESS = [
    *(f"{name}-float" for name in ("NO", "RLE", "ZIPS", "ZIP", "PIZ", "PXR24", "B44", "B44A")),
    *("ZIP-half", "PXR24-half", "float16", "RGBE"),
]
LOSSY = ["B44-half", "B44A-half", "DWAA-half", "DWAB-half", "DWAA-float", "DWAB-float"]


def stored(path: Path, image: np.ndarray, name: str) -> np.ndarray | Path:
    if name == "float16":
        return image.astype(np.float16)
    if name == "RGBE":
        return rgbe(path / "image.hdr", image)
    compression, kind = name.split("-")
    return exr(path / "image.exr", image, compression, np.float16 if kind == "half" else np.float32)


def with_light(image: np.ndarray, factor: float) -> np.ndarray:
    """The light that is seen, times a factor."""
    seen = (image == LIGHT).all(axis=2)
    assert seen.sum() > 20
    return np.where(seen[..., None], factor * image, image)


@pytest.mark.parametrize("name", LOSSLESS)
def test_a_right_image_of_each_format(tmp_path, name):
    image = honest(ROOM, 3)
    row = judged(ROOM, [stored(tmp_path, image, name)], margin=MARGIN)
    assert row["verdict"] == "agrees", row["reason"]
    row = judged(ROOM, [stored(tmp_path, with_light(image, 1.02), name)], margin=MARGIN)
    assert row["verdict"] == "differs"
    assert "emitter" in row["reason"]


@pytest.mark.parametrize("name", LOSSY)
def test_a_right_image_of_a_lossy_compression_is_said_to_be_one(tmp_path, name):
    image = honest(ROOM, 3)
    row = judged(ROOM, [stored(tmp_path, image, name)])
    assert row["verdict"] != "differs", row["reason"]
    assert row["margin"] == 0.01
    assert any(f"stored with {name.split('-')[0]}, which is lossy" in note for note in row["warnings"])
    surfaces = np.where(image == LIGHT, image, 1.1 * image)
    assert judged(ROOM, [stored(tmp_path, surfaces, name)])["verdict"] == "differs"


def test_what_is_far_from_edges_in_a_lossy_image_is_compared(tmp_path):
    image = honest(ROOM, 3)
    image[:3] = 0.01  # of the background
    row = judged(ROOM, [stored(tmp_path, image, "DWAA-half")])
    assert row["verdict"] == "differs"
    assert "background" in row["reason"]


LEVELS = {
    "truncate": lambda x, top: (top * x).astype(int),
    "round": lambda x, top: np.rint(top * x).astype(int),
    "floor256": lambda x, top: np.minimum((top + 1) * x, top).astype(int),
}


@pytest.mark.parametrize("kind", [np.uint8, np.uint16])
@pytest.mark.parametrize("rule", LEVELS)
def test_levels_by_each_rule(rule, kind):
    """Known and found out; eight bits read by another rule are off by a fifth to half a level."""
    top = int(np.iinfo(kind).max)
    levels = LEVELS[rule](np.clip(honest(ROOM, 3, 64), 0, 1), top).astype(kind)
    found, given = (judged(ROOM, [levels], samples=64, quantisation=how) for how in ("auto", rule))
    assert found["verdict"] != "differs", found["reason"]
    assert given["verdict"] != "differs", given["reason"]
    if kind is np.uint8:
        other = "round" if rule == "truncate" else "truncate"
        wrong = judged(ROOM, [levels], samples=64, quantisation=other)
        assert 0.15 < 255 * abs(wrong["bias"] - given["bias"]) < 0.7


@pytest.mark.parametrize("rule", LEVELS)
def test_a_light_below_white_tells_the_rule(rule):
    """Four samples are too noisy to; the light has no noise. Its value stands on the edge of a level."""
    made = ROOM.with_(lights=(replace(ROOM.lights[0], radiance=(0.8, 0.7, 0.6)),), light_samples=4)
    levels = LEVELS[rule](honest(made, 3, 4), 255).astype(np.uint8)
    row = judged(made, [levels])
    assert row["verdict"] != "differs", row["reason"]
    assert row["quantisation"]["rule"] == rule
