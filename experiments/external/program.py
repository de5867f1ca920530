"""Somebody's renderer: any program that writes an image, run for several seeds under a time limit.

No shell reads the command: it is split into words, and the words in braces are filled in. The program and all it
starts are one process group, which is ended with it.
"""

from __future__ import annotations

import contextlib
import os
import shlex
import signal
import string
import subprocess
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from nusselt.experiments.images.formats import Raw
from nusselt.experiments.images.read import READERS, read_image
from nusselt.experiments.scenes import catalogue
from nusselt.renderer.errors import InputError
from nusselt.renderer.scene import Scene
from nusselt.renderer.scene_text import write_scene
from nusselt.renderer.words import count

NEEDED = {"output"}
KNOWN = {"scene", "xml", "samples", "seed", "output", "threads"}
LAST = 4096
"""Bytes of a program's last words that are read."""


class ProgramFailed(RuntimeError):
    """A renderer that did not give an image; the message is one sentence."""


@dataclass(frozen=True)
class Program:
    """A renderer as a command.

    Parameters
    ----------
    command : str
        With {output} and, as it needs them, {scene}, {xml} (the exported Mitsuba scene), {samples}, {seed}, {threads}.
    kind : str
        Ending of the image it writes, such as ``.exr``.
    timeout : float
        Seconds of one run.
    """

    command: str
    kind: str = ".exr"
    timeout: float = 600.0

    def __post_init__(self) -> None:
        try:
            words = shlex.split(self.command)
            fields = {name for word in words for _, name, _, _ in string.Formatter().parse(word) if name is not None}
        except ValueError as error:
            raise InputError("renderer", self.command, f"a command that can be split into words ({error})") from None
        if not words or not fields >= NEEDED or not fields <= KNOWN:
            told = ", ".join("{" + name + "}" for name in sorted(KNOWN))
            raise InputError("renderer", self.command, f"a command with {{output}}, and of {told} those it needs")
        if self.kind not in READERS:
            raise InputError("image_type", self.kind, ", ".join(READERS))

    def words(self, **filled: object) -> list[str]:
        """The command's words, filled in."""
        return [word.format(**filled) for word in shlex.split(self.command)]


@dataclass(frozen=True)
class Run:
    """One image, its seed and samples, and its wall time in seconds."""

    raw: Raw
    seed: int
    samples: int
    seconds: float


class Renderer(Protocol):
    """Somebody's renderer, ready for one scene."""

    @property
    def takes_samples(self) -> bool:
        """Whether it is told how many."""
        ...

    def run(self, samples: int, seed: int) -> Run:
        """One image."""
        ...


class ProgramRenderer:
    """A program and the files it reads, for one scene; a context manager that cleans up.

    Parameters
    ----------
    program : Program
    scene : Scene
    name : str, optional
        The scene's file, or its name if it is a classic one; else the program is given a file of ours.
    threads : int, optional
        As many as there are processors, unless it says otherwise.
    """

    def __init__(self, program: Program, scene: Scene, name: str | None = None, threads: int | None = None) -> None:
        self.program, self.scene, self.name, self.threads = program, scene, name, threads or os.cpu_count() or 1

    @property
    def takes_samples(self) -> bool:
        return "{samples}" in self.program.command

    def __enter__(self) -> ProgramRenderer:
        self._folder = tempfile.TemporaryDirectory(prefix="nusselt-")
        folder = Path(self._folder.name)
        given = catalogue.file_of(self.name) if self.name else None
        self._scene = given or folder / "scene.test"
        if given is None:
            self._scene.write_text(write_scene(self.scene.with_(output="scene.png")), encoding="utf-8")
        self._xml = folder / "scene.xml"
        if "{xml}" in self.program.command:
            from nusselt.mitsuba_bridge.export import export_scene

            export_scene(self.scene, self._xml)
        return self

    def __exit__(self, *_: object) -> None:
        self._folder.cleanup()

    def run(self, samples: int, seed: int) -> Run:
        """One image.

        Raises
        ------
        InputError
            If the program cannot be started.
        ProgramFailed
            If it fails, takes too long, or writes no image of the scene.
        """
        output = Path(self._folder.name) / f"image-{samples}-{seed}{self.program.kind}"
        words = self.program.words(
            scene=self._scene.resolve(),
            xml=self._xml,
            samples=samples,
            seed=seed,
            threads=self.threads,
            output=output,
        )
        started = time.perf_counter()
        try:
            call(words, self.program.timeout)
            seconds = time.perf_counter() - started
            raw = _image(output, self.scene)
        except ProgramFailed as problem:
            raise ProgramFailed(
                f"{problem} (seed {seed}, {count(samples, 'sample')}: {shlex.join(words)})"
            ) from problem
        finally:
            output.unlink(missing_ok=True)
        return Run(raw, seed, samples, seconds)


def _image(output: Path, scene: Scene) -> Raw:
    try:
        return read_image(output, scene)
    except InputError as error:
        raise ProgramFailed(f"the renderer ended well and gave no image: {error}") from error


def call(words: list[str], timeout: float) -> None:
    """Run a program to its end, without input.

    Raises
    ------
    InputError
        If it cannot be started.
    ProgramFailed
        If it takes too long, or ends with another status than 0.
    """
    with tempfile.TemporaryFile() as said:
        try:
            process = subprocess.Popen(
                words, stdin=subprocess.DEVNULL, stdout=said, stderr=subprocess.STDOUT, start_new_session=True
            )
        except (OSError, ValueError) as error:
            told = getattr(error, "strerror", None) or str(error)
            raise InputError("renderer", words[0], f"a program that can be started ({told})") from error
        try:
            status = process.wait(timeout)
        except subprocess.TimeoutExpired:
            raise ProgramFailed(f"the renderer took more than {timeout:g} s and was ended") from None
        finally:
            end(process)
        if status:
            raise ProgramFailed(f"the renderer ended with status {status}{_last_words(said)}")


def end(process: subprocess.Popen[bytes]) -> None:
    """End a program, and whatever it left running."""
    with contextlib.suppress(ProcessLookupError, PermissionError):
        os.killpg(process.pid, signal.SIGKILL)
    with contextlib.suppress(subprocess.TimeoutExpired):
        process.wait(10)


def _last_words(said) -> str:  # type: ignore[no-untyped-def]
    said.seek(max(0, said.seek(0, os.SEEK_END) - LAST))
    lines = [line.strip() for line in said.read().decode("utf-8", "replace").splitlines() if line.strip()]
    return f": {lines[-1][:200]}" if lines else ""
