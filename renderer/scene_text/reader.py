"""The scene text format, read: one command a line, every number checked where it stands.

Runs of plain ``vertex`` and ``tri`` lines, nearly all of a big file, are taken many at a time; whatever is in
any doubt goes through the one-line path, so that each error names its own line.
"""

from __future__ import annotations

import math
import re
from pathlib import Path

from nusselt.renderer.errors import InputError, printable
from nusselt.renderer.scene import Scene

from .commands import COMMANDS, NUMBER, REFUSED
from .likeness import NAMES, likely
from .state import SceneState

MAX_BYTES = 1 << 28
MAX_LINE = 1 << 16
MAX_UNKNOWN = 50

# At most 4096 lines at once bounds the memory that their tokens take.
_RUN = re.compile(
    rf"(?P<vertex>(?:[ \t]{{0,64}}+vertex(?:[ \t]{{1,64}}+{NUMBER}){{3}}[ \t]{{0,64}}+\n){{1,4096}}+)"
    r"|(?P<tri>(?:[ \t]{0,64}+tri(?:[ \t]{1,64}+\d{1,18}+){3}[ \t]{0,64}+\n){1,4096}+)",
    re.ASCII,
)


def read_scene(path: str | Path, *, lenient: bool = False) -> Scene:
    """Read a scene file.

    Parameters
    ----------
    path : path
        A regular file of at most 256 MiB, UTF-8.
    lenient : bool
        Warn of an unknown command instead of refusing it; one that looks like a command, or stands between
        ``pushTransform`` and ``popTransform``, is refused all the same.

    Returns
    -------
    Scene
        Named after the file; ``warnings`` says what was ignored.

    Raises
    ------
    InputError
        For anything wrong with the file or in it, with its file and line.
    """
    where = printable(str(path))
    data = _bytes(Path(path), where).replace(b"\r\n", b"\n").replace(b"\r", b"\n")
    text = data.decode(errors="surrogateescape")  # comments may be in any encoding
    name, folder = printable(Path(path).stem), Path(path).parent
    return parse_scene(text, name=name, where=where, lenient=lenient, folder=folder)


def parse_scene(
    text: str, *, name: str = "scene", where: str = "<text>", lenient: bool = False, folder: Path | None = None
) -> Scene:
    """Read a scene from text.

    Parameters
    ----------
    text : str
        The scene's commands.
    name : str
        Name of the scene, for reports.
    where : str
        What errors and warnings call the text.
    lenient : bool
        Warn of an unknown command instead of refusing it; one that looks like a command, or stands between
        ``pushTransform`` and ``popTransform``, is refused all the same.
    folder : path, optional
        Where ``mesh`` finds its files; None: it is refused.

    Returns
    -------
    Scene

    Raises
    ------
    InputError
        For anything wrong in the text, with its line.
    """
    text = text.removeprefix("\ufeff").replace("\r\n", "\n").replace("\r", "\n")
    if (nul := text.find("\0")) >= 0:
        line = text.count("\n", 0, nul) + 1
        raise InputError("text", "\0", "text without NUL bytes", f"{where}:{line}")
    reader = _Reader(SceneState(where, folder), lenient)
    reader.read(text)
    return reader.state.scene(name)


def _check_utf8(token: str) -> None:
    try:
        token.encode()
    except UnicodeEncodeError:
        raise InputError("text", token.encode(errors="surrogateescape"), "UTF-8") from None


def _bytes(path: Path, where: str) -> bytes:
    """The file's content, if it is a regular file (a pipe or device could be endless) and not too long."""
    try:
        if not path.is_file():
            found = "a folder" if path.is_dir() else "a pipe or device" if path.exists() else "missing"
            raise InputError("scene file", found, "a regular file", where)
        with path.open("rb") as stream:
            data = stream.read(MAX_BYTES + 1)
    except OSError as error:
        found = error.strerror or type(error).__name__
        raise InputError("scene file", found, "a file that can be read", where) from None
    if len(data) > MAX_BYTES:
        raise InputError("scene file", f"over {MAX_BYTES} bytes", f"at most {MAX_BYTES} bytes", where)
    return data


class _Reader:
    """Feeds the lines of a text to the commands."""

    def __init__(self, state: SceneState, lenient: bool) -> None:
        self.state, self._lenient = state, lenient
        self._ignored: set[str] = set()  # unknown names

    def read(self, text: str) -> None:
        """Take every line of ``text``."""
        start = 0
        while start < len(text):
            if run := _RUN.match(text, start):
                self._take_run(run)
                start = run.end()
                continue
            end = text.find("\n", start)
            end = len(text) if end < 0 else end
            self._take_line(text[start:end])
            start = end + 1
        self.state.line = max(self.state.line - 1, 1)

    def _take_run(self, run: re.Match[str]) -> None:
        state, tokens = self.state, run.group().split()
        del tokens[::4]  # the command's name
        if run.lastgroup == "vertex":
            values = list(map(float, tokens))
            if good := all(map(math.isfinite, values)):
                state.pile.add_vertices(values)
        else:
            corners = list(map(int, tokens))
            if good := max(corners) < state.pile.vertex_count:
                state.pile.add_triangles(corners, state.line, state.transform)
        if good:
            state.line += len(tokens) // 3
        else:
            for line in run.group().split("\n")[:-1]:
                self._take_line(line)

    def _take_line(self, line: str) -> None:
        try:
            self._do(line)
        except InputError as error:
            raise (error if error.where else error.at(self.state.place)) from None
        self.state.line += 1

    def _do(self, line: str) -> None:
        if len(line) > MAX_LINE:
            raise InputError("text", f"a line of {len(line)} characters", f"at most {MAX_LINE} characters")
        tokens = self._without_comment(line)
        if not tokens:
            return
        name, given = NAMES.get(tokens[0].lower(), tokens[0]), tokens[1:]
        if name in REFUSED:
            raise InputError(name, " ".join(given) or "no argument", REFUSED[name])
        if command := COMMANDS.get(name):
            command.act(self.state, *command.values(name, given))
        else:
            self._unknown(name, f"{self.state.place}:{line.index(name) + 1}")

    def _without_comment(self, line: str) -> list[str]:
        """The words of a line up to its comment."""
        tokens = line.split()
        for number, token in enumerate(tokens):
            if token.startswith("#"):
                return tokens[:number]
            if token.startswith("//"):
                error = InputError("comment", token, "# before a comment (--lenient takes // too)")
                if not self._lenient:
                    raise error
                self.state.warn("// taken for a comment", self.state.place)
                return tokens[:number]
            if not token.isascii():
                _check_utf8(token)
        return tokens

    def _unknown(self, name: str, place: str) -> None:
        """Leave a command out, on request and where it can change neither a shape's place nor a light."""
        error = InputError("command", name, "a command of this format", place)
        if like := name not in self._ignored and likely(name):  # once a name: the likeness to every command is dear
            why = f" ({like}?)"
        elif self.state.is_pushed:
            why = ": between pushTransform and popTransform none is left out"
        elif not self._lenient:
            why = "; --lenient ignores it"
        elif len(self._ignored | {name}) > MAX_UNKNOWN:
            why = f", or at most {MAX_UNKNOWN} others"
        else:
            self._ignored.add(name)
            self.state.warn(f"unknown {error.at('')}: ignored", place)
            return
        raise InputError("command", name, error.accepted + why, place)
