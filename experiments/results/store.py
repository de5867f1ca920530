"""Passes on disk: whole files, named by what made them, so that a run goes on where another stopped."""

from __future__ import annotations

import dataclasses
import hashlib
import json
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from nusselt.experiments.files import replacing
from nusselt.mitsuba_bridge.reference import Reference
from nusselt.renderer.image import Image
from nusselt.renderer.needs import LeftOut

from .document import package_versions, plain

Kept = TypeVar("Kept", Image, Reference)


def key_of(*told: Any) -> str:
    """A name for everything that can change a figure: what is told, and the versions of all packages."""
    text = json.dumps([*map(str, told), package_versions()], sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()[:20]


class Store:
    """A folder of parts."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def has(self, name: str) -> bool:
        """Whether a part is there, and whole."""
        return self._path(name).exists()

    def get(self, kind: type[Kept], name: str, make: Callable[[], Kept]) -> Kept:
        """A part from disk; made and kept if it is not there, or cannot be read.

        Raises
        ------
        InputError
            If the folder cannot be written to.
        """
        try:
            return self._read(kind, self._path(name))
        except (OSError, ValueError, KeyError, TypeError, EOFError, zipfile.BadZipFile):
            made = make()
            self._write(made, self._path(name))
            return made

    def _path(self, name: str) -> Path:
        return self.folder / f"{name}.npz"

    @staticmethod
    def _read(kind: type[Kept], path: Path) -> Kept:
        with np.load(path, allow_pickle=False) as archive:
            arrays = {name: archive[name] for name in archive.files}
        words = json.loads(str(arrays.pop("words")))
        for name, value in words.items():
            words[name] = tuple(value) if isinstance(value, list) else value
        if "left_out" in words:
            words["left_out"] = tuple(LeftOut(**entry) for entry in words["left_out"])
        return kind(**arrays, **words)

    @staticmethod
    def _write(made: Image | Reference, path: Path) -> None:
        fields = {field.name: getattr(made, field.name) for field in dataclasses.fields(made)}
        arrays = {name: value for name, value in fields.items() if isinstance(value, np.ndarray)}
        words = {name: value for name, value in fields.items() if name not in arrays}
        if "left_out" in words:
            words["left_out"] = [dataclasses.asdict(entry) for entry in words["left_out"]]
        with replacing(path) as beside:
            np.savez(beside, allow_pickle=False, words=np.array(json.dumps(plain(words))), **arrays)
