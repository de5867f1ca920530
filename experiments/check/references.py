"""References that are kept: one .npz file says what made it, of which scene, and is refused where it does not fit.

Arrays only, no pickled objects; the head is JSON in an array of bytes.
"""

from __future__ import annotations

import hashlib
import json
import zipfile
import zlib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from nusselt.experiments.files import replacing
from nusselt.experiments.results.document import package_versions
from nusselt.mitsuba_bridge.reference import SHAPES, Reference
from nusselt.renderer.errors import InputError
from nusselt.renderer.scene import Scene
from nusselt.renderer.vectors import Floats

from .check import Progress, References
from .expectations import appearance
from .question import Question

KIND = "nusselt reference"
FORMAT = 2
RULE = "direct lighting, emission on one side of -(ab x ac), radiance at "
"""With the pixel rule: what the numbers are."""
LIMIT = 1 << 16
"""Bytes the head may have."""
TOLD = ("samples", "passes", "renderer", "version", "variant", "llvm", "notes", "seconds")


def rule_of(scene: Scene) -> str:
    """What a pixel of a reference means."""
    return RULE + ("pixel centres" if scene.spp == 1 else "all of each pixel's box")


def identity(scene: Scene) -> str:
    """The scene as far as its reference depends on it."""
    return appearance(scene).digest()


def write_reference(path: Path, scene: Scene, reference: Reference, target: float) -> None:
    """Keep a reference; its arrays in full precision.

    Parameters
    ----------
    target : float
        Relative standard error it was made for.
    """
    if path.suffix != ".npz":
        raise InputError("output", str(path), "a name that ends in .npz")
    head = {
        "kind": KIND,
        "format": FORMAT,
        "scene": identity(scene),
        "scene_name": scene.name,
        "rule": rule_of(scene),
        "target": target,
        "size": [scene.width, scene.height],
        "made_by": package_versions(),
        **{name: getattr(reference, name) for name in TOLD},
    }
    arrays = {name: getattr(reference, name) for name in (*SHAPES, "pass_means")}
    words = np.frombuffer(json.dumps(head, default=str).encode(), dtype=np.uint8)
    with replacing(path) as beside, beside.open("wb") as stream:
        np.savez_compressed(stream, allow_pickle=False, head=words, **arrays)


def read_reference(path: Path, scene: Scene) -> tuple[Reference, dict[str, Any]]:
    """A kept reference of this very scene, and its head.

    Raises
    ------
    InputError
        If the file is damaged, of another scene, rule or format.
    """
    try:
        with zipfile.ZipFile(path) as archive:
            _check_members(path, archive, scene)
        with np.load(path, allow_pickle=False) as arrays:
            head = json.loads(bytes(arrays["head"]))
            _check_head(path, head, scene)
            found = {name: np.asarray(arrays[name], dtype=np.float64) for name in (*SHAPES, "pass_means")}
    except InputError:
        raise
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile, zlib.error, NotImplementedError) as error:
        told = " ".join(str(error).split())[:60]
        raise _refuse(path, f"damaged ({told})", "a file written by `nusselt reference`") from error
    for name, channels in SHAPES.items():
        shape = (channels, scene.height, scene.width) if channels else (scene.height, scene.width)
        if found[name].shape != shape or not np.isfinite(found[name]).all():
            raise _refuse(path, f"damaged (its {name})", f"finite numbers of shape {shape}")
    return _reference(path, found, head), head


def _reference(path: Path, found: Mapping[str, Floats], head: dict[str, Any]) -> Reference:
    llvm = head["llvm"]
    try:
        return Reference(
            mean=found["mean"],
            standard_error=found["standard_error"],
            pixel_standard_error=found["pixel_standard_error"],
            emitter=found["emitter"],
            background=found["background"],
            holes=found["holes"],
            pass_means=found["pass_means"],
            samples=int(head["samples"]),
            passes=int(head["passes"]),
            renderer=str(head["renderer"]),
            version=str(head["version"]),
            variant=str(head["variant"]),
            llvm=None if llvm is None else str(llvm),
            notes=tuple(str(note) for note in head["notes"]),
            seconds=dict(head["seconds"]),
        )
    except (TypeError, ValueError) as error:
        raise _refuse(path, f"damaged ({error})", "a file written by `nusselt reference`") from error


def _refuse(path: Path, found: str, accepted: str) -> InputError:
    return InputError("reference", found, accepted, str(path))


def _check_members(path: Path, archive: zipfile.ZipFile, scene: Scene) -> None:
    """What the archive says it unpacks to is bounded by the scene's size."""
    limit = LIMIT + 8 * scene.width * scene.height * 3 + (1 << 20)
    for member in archive.infolist():
        if member.file_size > limit:
            raise _refuse(path, f"{member.filename} of {member.file_size} bytes", f"at most {limit} for this scene")


def _check_head(path: Path, head: Any, scene: Scene) -> None:
    if not isinstance(head, dict) or head.get("kind") != KIND:
        raise _refuse(path, "no head", "a file written by `nusselt reference`")
    if head.get("format") != FORMAT:
        raise _refuse(path, f"format {head.get('format')}", f"format {FORMAT}: make it again")
    if head.get("rule") != rule_of(scene):
        raise _refuse(path, f"rule: {head.get('rule')}", f"rule: {rule_of(scene)}")
    if head.get("scene") != identity(scene):
        other = f"made of another scene or an older one: {head.get('scene_name')}"
        raise InputError("reference", other, f"one of this scene ({identity(scene)[:12]}): make it again", str(path))
    missing = [name for name in TOLD if name not in head]
    if missing:
        raise _refuse(path, f"no {missing[0]} in its head", "a file written by `nusselt reference`")


@dataclass(frozen=True)
class Cache:
    """References on disk by content; without a folder nothing is kept.

    Parameters
    ----------
    folder : Path or None
    """

    folder: Path | None = None

    def _path(self, scene: Scene, target: float) -> Path | None:
        if self.folder is None:
            return None
        version = str(package_versions()["mitsuba"])
        told = json.dumps([identity(scene), rule_of(scene), version, f"{target:.6g}", FORMAT])
        return self.folder / f"{scene.name}-{hashlib.sha256(told.encode()).hexdigest()[:24]}.npz"

    def find(self, scene: Scene, target: float) -> Reference | None:
        """A kept reference; one that is damaged or stale is made again."""
        path = self._path(scene, target)
        if path is None or not path.exists():
            return None
        try:
            return read_reference(path, scene)[0]
        except InputError:
            return None

    def keep(self, scene: Scene, reference: Reference, target: float) -> None:
        """Keep what was made."""
        path = self._path(scene, target)
        if path is not None:
            write_reference(path, scene, reference, target)


class KeptReferences(References):
    """References for `check`: a file's, or the cache's, or Mitsuba's, which the cache then keeps."""

    def __init__(self, given: Path | None, folder: Path | None) -> None:
        super().__init__()
        self._given, self._cache = given, Cache(folder)

    def given(self, scene: Scene) -> Reference | None:
        """What the user's file says of a scene, if there is one."""
        return None if self._given is None else read_reference(self._given, scene)[0]

    def get(self, scene: Scene, question: Question, target: float, progress: Progress | None) -> Reference:
        """The reference of a scene; one from a file is taken with the noise it has."""
        given = self.given(scene)
        if given is not None:
            return given
        found = self._cache.find(scene, target)
        if found is None:
            found = super().get(scene, question, target, progress)
            self._cache.keep(scene, found, target)
        return found
