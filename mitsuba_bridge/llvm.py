"""Which LLVM Mitsuba's fast variant can use: proven by a real render in a child process, never assumed.

LLVM 14 is refused by Dr.Jit and LLVM 15 aborts the whole process at the first minimum; a trivial kernel passes
on both. So candidates are the library of the package `karellen-llvm-core`, then the system's from 16 upwards,
newest first, each tried with a render; when none works, `scalar_rgb` does the diffuse scenes.
"""

from __future__ import annotations

import os
import re
import sys
from dataclasses import dataclass
from functools import lru_cache
from importlib import metadata
from pathlib import Path
from typing import Any

from .process import ReferenceUnavailable
from .standing import run_job
from .temporary import temporary_folder

OLDEST = 16
PROOF_SECONDS = 120.0
SYSTEM = (
    "/usr/lib/*-linux-gnu/libLLVM*.so*",
    "/usr/lib64/libLLVM*.so*",
    "/usr/lib/llvm-*/lib/libLLVM*.so*",
    "/usr/local/lib/libLLVM*.so*",
)


@dataclass(frozen=True)
class Backend:
    """How Mitsuba is to be run.

    Parameters
    ----------
    variant : {"llvm_ad_rgb", "scalar_rgb"}
    llvm : Path or None
        The proven library.
    sentence : str
        Which and why.
    """

    variant: str
    llvm: Path | None
    sentence: str


def package_libraries(prefix: Path | None = None) -> list[Path]:
    """Libraries that `karellen-llvm-core` has put into the environment's lib folder."""
    found = sorted((Path(sys.prefix) if prefix is None else prefix).glob("lib/libLLVM.so*"), key=lambda p: len(p.name))
    return found[-1:]


def version_of(path: Path) -> int | None:
    """Major version in a library's name (resolved), None where it has none."""
    for name in (path.name, path.resolve().name, path.parent.parent.name):
        match = re.search(r"(?:LLVM|llvm)[^0-9]*?(\d+)", name)
        if match and 3 < int(match[1]) < 1000:
            return int(match[1])
    return None


def system_libraries(patterns: tuple[str, ...] = SYSTEM) -> list[Path]:
    """The system's libraries from LLVM 16 upwards, newest first, each once."""
    found: dict[Path, int] = {}
    for pattern in patterns:
        root = Path(pattern.split("*")[0]).parent if "*" in pattern else Path(pattern)
        while not root.is_dir() and root != root.parent:
            root = root.parent
        try:
            paths = list(root.glob(str(Path(pattern).relative_to(root))))
        except (OSError, ValueError):
            continue
        for path in paths:
            version = version_of(path)
            if version is not None and version >= OLDEST and path.is_file():
                found[path.resolve()] = version
    return sorted(found, key=lambda path: (-found[path], str(path)))


def prove(variant: str, llvm: Path | None, timeout: float = PROOF_SECONDS) -> dict[str, Any]:
    """Render something small in a child.

    Raises
    ------
    ReferenceUnavailable
        With what became of the child.
    """
    with temporary_folder() as folder:
        return run_job({"task": "proof"}, Path(folder), variant, llvm, timeout)[0]


def find_backend(candidates: list[tuple[str, Path]] | None = None) -> Backend:
    """The first candidate that proves itself, else scalar_rgb.

    Raises
    ------
    ReferenceUnavailable
        If Mitsuba cannot run at all.
    """
    tried: list[str] = []
    for origin, path in _candidates() if candidates is None else candidates:
        try:
            told = prove("llvm_ad_rgb", path)
        except ReferenceUnavailable as problem:
            tried.append(f"{path.name} from {origin} failed its proof ({problem})")
            continue
        sentence = f"Mitsuba {told['version']} runs in llvm_ad_rgb with LLVM {told['llvm']} from {origin}"
        return Backend("llvm_ad_rgb", path, "; ".join([sentence + ", proven by a render", *tried]))
    told = prove("scalar_rgb", None)
    why = "; ".join(tried) if tried else f"no LLVM of version {OLDEST} or newer was found"
    sentence = f"Mitsuba {told['version']} runs in scalar_rgb, for diffuse scenes only: {why}"
    return Backend("scalar_rgb", None, sentence)


def _candidates() -> list[tuple[str, Path]]:
    named = os.environ.get("DRJIT_LIBLLVM_PATH")
    given = [("DRJIT_LIBLLVM_PATH", Path(named))] if named else []
    package = [("the package karellen-llvm-core", path) for path in package_libraries()]
    return given + package + [("the system", path) for path in system_libraries()]


@lru_cache(maxsize=1)
def backend() -> Backend:
    """`find_backend`, once a process."""
    return find_backend()


def backend_report() -> tuple[bool, list[str]]:
    """For `nusselt doctor`: whether references can be rendered, and the sentences that say why."""
    try:
        metadata.version("mitsuba")
    except metadata.PackageNotFoundError:
        return False, ["Mitsuba is missing; mend with: pip install mitsuba"]
    try:
        found = backend()
    except ReferenceUnavailable as problem:
        return False, [f"Mitsuba does not run: {problem}", "mend with: make setup"]
    lines = [found.sentence]
    if found.variant == "scalar_rgb":
        lines += [
            "glossy scenes will be undecided: they need an LLVM",
            "mend with: pip install karellen-llvm-core (Linux x86-64), or install an LLVM of version 16 or newer",
        ]
    return True, lines
