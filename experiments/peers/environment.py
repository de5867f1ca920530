"""Where peers live: an environment each, outside ours, made of pinned packages; or a program on the PATH."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path

from nusselt.renderer.errors import InputError

from .peer import Peer

VARIABLE = "NUSSELT_PEERS"
"""Of the environment: the folder of all environments."""
MARK = "nusselt-peer.json"
"""Written last: an environment without it was never finished."""
TIMEOUT = 1800.0
"""Seconds of an installation; Blender is half a gigabyte to fetch."""


class InstallFailed(RuntimeError):
    """An environment that could not be made; the message is one sentence."""


def default_folder() -> Path:
    """In the user's cache, unless the environment says where."""
    cache = os.environ.get("XDG_CACHE_HOME") or str(Path.home() / ".cache")
    return Path(os.environ.get(VARIABLE) or Path(cache, "nusselt", "peers"))


@dataclass(frozen=True)
class Environments:
    """All peers' environments, in one folder."""

    folder: Path

    def launch(self, peer: Peer) -> list[str] | None:
        """The words that run a peer's adapter, before its arguments, none where it needs none; None: it is missing."""
        if peer.within:
            return [] if find_spec(peer.within) else None
        python = self._python(peer)
        if (self.folder / peer.name / MARK).is_file() and python.exists():
            return [str(python), str(peer.adapter)]
        found = shutil.which(peer.program.name) if peer.program else None
        if peer.program is None or found is None:
            return None
        if peer.program.script:
            return [found, *peer.program.script, str(peer.adapter), "--"]
        return [sys.executable, str(peer.adapter)]

    def status(self, peer: Peer) -> str:
        """Where it is, or what would bring it."""
        words = self.launch(peer)
        if words is None:
            return " or ".join(how_to_have(peer))
        if not words:
            return f"in {sys.prefix}"
        return words[0] if words[0] != sys.executable else str(shutil.which(peer.program.name if peer.program else ""))

    def _python(self, peer: Peer) -> Path:
        return self.folder / peer.name / "bin" / "python"

    def install(self, peer: Peer, python: str = sys.executable) -> list[str]:
        """Make a peer's environment, anew if there is one; returns its packages.

        Raises
        ------
        InputError
            If the peer has no packages, or none for this Python.
        InstallFailed
            If they cannot be installed.
        """
        packages = packages_for(peer, version_of(python))
        place = self.folder / peer.name
        shutil.rmtree(place, ignore_errors=True)
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
            _run([python, "-m", "venv", str(place)])
            pip = [str(self._python(peer)), "-m", "pip", "--quiet", "--disable-pip-version-check", "install"]
            _run([*pip, *packages])
            (place / MARK).write_text(json.dumps({"packages": packages}), encoding="utf-8")
        except OSError as error:
            raise InstallFailed(f"{place} cannot be written to ({error.strerror})") from error
        return packages


def how_to_have(peer: Peer) -> list[str]:
    """What a user does to have it."""
    ways = [f"nusselt peers install {peer.name}"] if peer.packages else []
    ways += [f"pip install {peer.within}"] if peer.within else []
    return ways + ([peer.program.source] if peer.program else [])


def packages_for(peer: Peer, version: str) -> list[str]:
    """A peer's packages for a version of Python, such as "3.11".

    Raises
    ------
    InputError
    """
    if not peer.packages:
        raise InputError("peer", peer.name, f"one that packages bring; this one is had by: {how_to_have(peer)[0]}")
    found = peer.packages.get(version) or peer.packages.get("")
    if found is None:
        known = " or ".join(peer.packages)
        ways = " or ".join(
            ("name one with --python", *([f"have {peer.program.name} on the PATH"] if peer.program else []))
        )
        raise InputError("python", version, f"Python {known}, which {peer.title} is made for: {ways}")
    return list(found)


def version_of(python: str) -> str:
    """Major and minor version of a Python.

    Raises
    ------
    InputError
        If it is none.
    """
    ask = "import sys; print('%d.%d' % sys.version_info[:2])"
    try:
        said = subprocess.run([python, "-c", ask], capture_output=True, text=True, timeout=60)
    except (OSError, ValueError, subprocess.TimeoutExpired):
        said = None
    if said is None or said.returncode or not re.fullmatch(r"\d+\.\d+", said.stdout.strip()):
        raise InputError("python", python, "a Python that can be run")
    return said.stdout.strip()


def _run(words: list[str]) -> None:
    try:
        done = subprocess.run(words, capture_output=True, text=True, timeout=TIMEOUT)
    except subprocess.TimeoutExpired as error:
        raise InstallFailed(f"{words[-1]} took more than {TIMEOUT:g} s") from error
    if done.returncode:
        last = [line for line in (done.stdout + done.stderr).splitlines() if line.strip()][-1:]
        raise InstallFailed(" ".join((f"{words[0]} ended with status {done.returncode}:", *last))[:400])
