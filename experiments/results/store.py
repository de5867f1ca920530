"""What is kept on disk: one archive each, named by a digest of all that can change what is in it.

An archive is an .npz of plain arrays and, under ``head``, words as JSON in an array of bytes: no pickled objects. It is
whole or not there. One that cannot be read is taken for not there, and made again.
"""

from __future__ import annotations

import hashlib
import json
import zipfile
import zlib
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, fields, is_dataclass
from decimal import Decimal
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from nusselt.experiments.files import replacing
from nusselt.mitsuba_bridge.reference import Reference
from nusselt.renderer.image import Image
from nusselt.renderer.needs import LeftOut
from nusselt.renderer.scene import Scene

from .document import package_versions, plain

Array = np.ndarray[Any, Any]
Parts = tuple[dict[str, Any], dict[str, Array]]
"""Words and arrays."""
Made = TypeVar("Made")
Kept = TypeVar("Kept", Image, Reference)
UNREADABLE = (OSError, ValueError, KeyError, TypeError, EOFError, zipfile.BadZipFile, zlib.error, NotImplementedError)
"""What a damaged archive raises."""


def digest(*told: Any) -> str:
    """A name for what is told: 24 digits that tell it from everything else."""
    return hashlib.sha256(json.dumps(_said(told), sort_keys=True, default=str).encode()).hexdigest()[:24]


def key_of(*told: Any) -> str:
    """A name for what is told and the versions of all packages."""
    return digest(*told, package_versions())


def _said(value: Any) -> Any:
    """As JSON: scenes by their content, dataclasses by their type and fields."""
    if isinstance(value, Scene):
        return {"scene": value.name, "digest": value.digest()}
    if isinstance(value, dict):
        return {str(key): _said(entry) for key, entry in value.items()}
    if isinstance(value, (list, tuple)):
        return [_said(entry) for entry in value]
    if is_dataclass(value):
        return {"type": type(value).__qualname__} | {f.name: _said(getattr(value, f.name)) for f in fields(value)}
    return str(value) if isinstance(value, Path | Decimal) else plain(value)


def write_archive(path: Path, words: Mapping[str, Any], arrays: Mapping[str, Array]) -> None:
    """Write an archive; arrays in full precision.

    Raises
    ------
    InputError
        If the folder cannot be written to.
    """
    head = np.frombuffer(json.dumps(plain(words)).encode(), dtype=np.uint8)
    with replacing(path) as beside, beside.open("wb") as stream:
        np.savez_compressed(stream, allow_pickle=False, head=head, **arrays)


def read_archive(path: Path) -> Parts:
    """Words and arrays of an archive; one of `UNREADABLE` is raised where it is none."""
    with np.load(path, allow_pickle=False) as archive:
        arrays = {name: archive[name] for name in archive.files}
    words = json.loads(bytes(arrays.pop("head")))
    if not isinstance(words, dict):
        raise ValueError("its head is no object")
    return words, arrays


@dataclass(frozen=True)
class Store:
    """A folder of archives; without a folder nothing is kept."""

    folder: Path | None

    def path(self, name: str) -> Path | None:
        """Where an archive is, or would be."""
        return None if self.folder is None else self.folder / f"{name}.npz"

    def has(self, name: str) -> bool:
        """Whether it is there."""
        path = self.path(name)
        return path is not None and path.exists()

    def find(self, name: str, unpack: Callable[[dict[str, Any], dict[str, Array]], Made]) -> Made | None:
        """What is kept under a name; None where nothing is, or it cannot be read."""
        path = self.path(name)
        try:
            return None if path is None else unpack(*read_archive(path))
        except UNREADABLE:
            return None

    def keep(self, name: str, words: Mapping[str, Any], arrays: Mapping[str, Array]) -> None:
        """Keep words and arrays under a name."""
        path = self.path(name)
        if path is not None:
            write_archive(path, words, arrays)

    def get(self, kind: type[Kept], name: str, make: Callable[[], Kept]) -> Kept:
        """An image or a reference; made and kept where it is not there."""
        found = self.find(name, lambda words, arrays: unpacked(kind, words, arrays))
        if found is None:
            found = make()
            self.keep(name, *packed(found))
        return found


def packed(made: Image | Reference) -> Parts:
    """All fields of an image or a reference."""
    values = {field.name: getattr(made, field.name) for field in fields(made)}
    arrays = {name: value for name, value in values.items() if isinstance(value, np.ndarray)}
    words = {name: value for name, value in values.items() if name not in arrays}
    if "left_out" in words:
        words["left_out"] = [asdict(entry) for entry in words["left_out"]]
    return words, arrays


def unpacked(kind: type[Kept], words: Mapping[str, Any], arrays: Mapping[str, Array]) -> Kept:
    """The image or reference of these fields; TypeError where they are not its own."""
    told: dict[str, Any] = {name: tuple(value) if isinstance(value, list) else value for name, value in words.items()}
    if "left_out" in told:
        told["left_out"] = tuple(LeftOut(**entry) for entry in told["left_out"])
    return kind(**(told | dict(arrays)))
