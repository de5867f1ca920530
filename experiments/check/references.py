"""References that are kept: one .npz file says what made it, of which scene, and is refused where it does not fit.

Arrays only, no pickled objects; the head is JSON in an array of bytes.
"""

from __future__ import annotations

import zipfile
from pathlib import Path
from typing import Any

import numpy as np

from nusselt.experiments.files import folder_name
from nusselt.experiments.results.document import package_versions
from nusselt.experiments.results.schema import REFERENCE, check_entries
from nusselt.experiments.results.store import (
    UNREADABLE,
    Store,
    digest,
    packed,
    read_archive,
    unpacked,
    write_archive,
)
from nusselt.mitsuba_bridge.reference import SHAPES, Reference
from nusselt.renderer.errors import InputError
from nusselt.renderer.scene import Scene

from .check import Progress, References
from .expectations import appearance
from .question import Question
from .rounded import as_kept, restored, rounded

KIND = "nusselt reference"
FORMAT = 4
RULE = "direct lighting, emission on one side of -(ab x ac), radiance at "
"""With the pixel rule: what the numbers are."""
EXACT = ("emitter", "background", "holes")
"""Arrays that are kept as they are."""
LIMIT = 1 << 16
"""Bytes the head may have."""
WRITTEN = "a file written by `nusselt reference`"
TOLD = ("samples", "passes", "renderer", "version", "variant", "llvm", "notes", "seconds", "limits")


def rule_of(scene: Scene) -> str:
    """What a pixel of a reference means."""
    return RULE + ("pixel centres" if scene.spp == 1 else "all of each pixel's box")


def identity(scene: Scene) -> str:
    """The scene as far as its reference depends on it."""
    return appearance(scene).digest()


def write_reference(path: Path, scene: Scene, reference: Reference, target: float) -> None:
    """Keep a reference, rounded by a share of its noise; see `rounded`.

    Parameters
    ----------
    target : float
        Relative standard error it was made for.
    """
    if path.suffix != ".npz":
        raise InputError("output", str(path), "a name that ends in .npz")
    words, arrays = packed(reference)
    arrays = {name: arrays[name] for name in EXACT}
    head = {
        "kind": KIND,
        "format": FORMAT,
        "scene": identity(scene),
        "scene_name": scene.name,
        "rule": rule_of(scene),
        "target": target,
        "size": [scene.width, scene.height],
        "made_by": package_versions(),
        **words,
    }
    write_archive(path, head, arrays | rounded(reference))


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
        head, arrays = read_archive(path)
        _check_head(path, head, scene)
        found = {name: np.asarray(arrays[name], dtype=np.float64) for name in EXACT}
        found |= restored(arrays, scene.height, scene.width)
    except InputError:
        raise
    except UNREADABLE as error:
        told = " ".join(str(error).split())[:60]
        raise _refuse(path, f"damaged ({told})", WRITTEN) from error
    for name, channels in SHAPES.items():
        shape = (channels, scene.height, scene.width) if channels else (scene.height, scene.width)
        if found[name].shape != shape or not np.isfinite(found[name]).all():
            raise _refuse(path, f"damaged (its {name})", f"finite numbers of shape {shape}")
    counts = head.get("light_samples", [])  # files of older versions do not say
    if not isinstance(counts, list) or not all(isinstance(count, int) and count > 0 for count in counts):
        raise InputError("light_samples", counts, "whole numbers above 0", str(path))
    words = {name: head[name] for name in TOLD} | {"light_samples": counts}
    return unpacked(Reference, words, found), head


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
        raise _refuse(path, "no head", WRITTEN)
    if head.get("format") != FORMAT:
        raise _refuse(path, f"format {head.get('format')}", f"format {FORMAT}: make it again")
    if head.get("rule") != rule_of(scene):
        raise _refuse(path, f"rule: {head.get('rule')}", f"rule: {rule_of(scene)}")
    if head.get("scene") != identity(scene):
        other = f"made of another scene or an older one: {head.get('scene_name')}"
        raise InputError("reference", other, f"one of this scene ({identity(scene)[:12]}): make it again", str(path))
    missing = [name for name in TOLD if name not in head or (head[name] is None and name != "llvm")]
    if missing:
        raise _refuse(path, f"no {missing[0]} in its head", WRITTEN)
    check_entries(head, REFERENCE, str(path))
    if not isinstance(head["seconds"], dict):
        raise InputError("seconds", head["seconds"], "an object", str(path))


class Cache:
    """References on disk by content; without a folder nothing is kept."""

    def __init__(self, folder: Path | None) -> None:
        self._store = Store(folder)

    def _path(self, scene: Scene, target: float) -> Path | None:
        version = str(package_versions()["mitsuba"])
        told = digest(identity(scene), rule_of(scene), version, f"{target:.6g}", FORMAT)
        return self._store.path(f"{folder_name(scene.name)}-{told}")

    def find(self, scene: Scene, target: float) -> Reference | None:
        """A kept reference; one that is damaged or stale is made again."""
        path = self._path(scene, target)
        try:
            return read_reference(path, scene)[0] if path is not None and path.exists() else None
        except InputError:
            return None

    def keep(self, scene: Scene, reference: Reference, target: float) -> Reference:
        """Keep what was made; returns it as it will be read again."""
        path = self._path(scene, target)
        if path is None:
            return reference
        write_reference(path, scene, reference, target)
        return as_kept(reference)


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
            found = self._cache.keep(scene, super().get(scene, question, target, progress), target)
        return found
