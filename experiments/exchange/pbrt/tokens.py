"""pbrt's text in directives: a word, its plain arguments and its parameters, each with its file and line.

No package of the registries reads it; the grammar is four kinds of token.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from nusselt.renderer.errors import InputError
from nusselt.renderer.validation import Vec3
from nusselt.renderer.vectors import Floats

MAX_BYTES = 1 << 28
_TOKEN = re.compile(r'\s++|#[^\n]*+|(?P<string>"(?:[^"\\\n]|\\.)*+")|(?P<bracket>[\[\]])|(?P<word>[^\s"\[\]#]++)')
_NUMBER = re.compile(r"[+-]?+(?:\d++\.?+\d*+|\.\d++)(?:[eE][+-]?+\d++)?+", re.ASCII)
KINDS = ("integer", "float", "string", "bool", "point3", "point2", "vector3", "normal", "rgb", "texture")
SPECTRA = ("spectrum", "blackbody")


@dataclass(frozen=True)
class Token:
    """A string without its quotes, a bracket, or a word; and its place."""

    kind: str
    text: str
    where: str


@dataclass(frozen=True)
class Parameter:
    """A typed list of values."""

    kind: str
    values: tuple[str, ...]
    where: str


@dataclass(frozen=True)
class Directive:
    """One directive of a file."""

    name: str
    arguments: tuple[str, ...]
    parameters: dict[str, Parameter]
    where: str

    @property
    def kind(self) -> str:
        """Its first argument: the kind of shape, light, material."""
        return self.arguments[0] if self.arguments else ""

    def refused(self, value: object, accepted: str, name: str = "") -> InputError:
        """The error that refuses it, at a parameter's line if one is named."""
        where = self.parameters[name].where if name in self.parameters else self.where
        return InputError(f"{self.name} {self.kind}".strip(), value, accepted, where)

    def only(self, *names: str) -> None:
        """Refuse parameters of other names: none is left out without a word."""
        for name in self.parameters:
            if name not in names:
                raise self.refused(name, f"its {', '.join(names)}" if names else "no parameter", name)

    def numbers(self, name: str, kinds: tuple[str, ...], default: Floats | None = None) -> Floats:
        """Values of a parameter of some kind."""
        found = self.parameters.get(name)
        if found is None:
            if default is None:
                raise self.refused(f"no {name}", f"{name}, a list of {kinds[0]}")
            return default
        if found.kind not in kinds:
            raise self.refused(f"{name}: {found.kind}", f"{' or '.join(kinds)} {name}", name)
        return np.array([number_of(value, f"{self.name} {name}", found.where) for value in found.values])

    def number(self, name: str, default: float, kinds: tuple[str, ...] = ("float", "integer")) -> float:
        values = self.numbers(name, kinds, np.array([default]))
        if values.size != 1:
            raise self.refused(f"{name}: {values.size} values", "one", name)
        return float(values[0])

    def whole(self, name: str, default: int) -> int:
        value = self.number(name, default, ("integer",))
        if value % 1:
            raise self.refused(f"{name} {value:g}", "a whole number", name)
        return int(value)

    def point(self, name: str, default: Vec3) -> Floats:
        values = self.numbers(name, ("point3", "point"), np.array(default))
        if values.size != 3:
            raise self.refused(f"{name}: {values.size} values", "three", name)
        return values

    def colour(self, name: str, default: float) -> Vec3:
        """An rgb value, of the default colour space: of a light, as multiples of white."""
        found = self.parameters.get(name)
        if found is not None and found.kind in SPECTRA:
            raise self.refused(f"{name}: a {found.kind}", f"rgb {name}: colours here are three numbers", name)
        r, g, b = self.triples(name, ("rgb",), np.full(3, default))[:, 0].tolist()
        return r, g, b

    def triples(self, name: str, kinds: tuple[str, ...], default: Floats | None = None) -> Floats:
        """Values three by three, (3, n)."""
        values = self.numbers(name, kinds, default)
        if values.size % 3 or not values.size:
            raise self.refused(f"{name}: {values.size} values", "three by three", name)
        return values.reshape(-1, 3).T

    def indices(self, name: str, default: Floats | None, count: int) -> np.ndarray:
        """Whole numbers below a count."""
        values = self.numbers(name, ("integer",), default)
        if values.size and (values.min() < 0 or values.max() >= count or (values % 1).any()):
            raise self.refused(f"{name} outside 0 to {count - 1}", f"indices of the {count} points", name)
        return values.astype(np.int64)

    def word(self, name: str, default: str) -> str:
        found = self.parameters.get(name)
        if found is not None and (found.kind != "string" or len(found.values) != 1):
            raise self.refused(f"{name}: {found.kind}", f"string {name}", name)
        return found.values[0] if found is not None else default

    def flag(self, name: str) -> bool:
        found = self.parameters.get(name)
        if found is not None and (found.kind != "bool" or found.values not in (("true",), ("false",))):
            raise self.refused(f"{name}: {' '.join(found.values)}", f"bool {name}: true or false", name)
        return found is not None and found.values == ("true",)


def number_of(text: str, argument: str, where: str) -> float:
    """A finite decimal number."""
    value = float(text) if _NUMBER.fullmatch(text) else math.nan
    if not math.isfinite(value):
        raise InputError(argument, text, "a finite decimal number", where)
    return value


def read_text(path: Path, where: str) -> str:
    """A file's text; at most 256 MiB of UTF-8."""
    try:
        if path.stat().st_size > MAX_BYTES:
            raise InputError("file", f"over {MAX_BYTES} bytes", f"at most {MAX_BYTES} bytes", where)
        return path.read_text(encoding="utf-8")
    except UnicodeDecodeError:
        raise InputError("file", "no UTF-8 text", "a pbrt scene, which is text", where) from None
    except OSError as error:
        raise InputError("file", error.strerror or type(error).__name__, "a file that can be read", where) from None


def tokens(text: str, name: str) -> Iterator[Token]:
    """Of a text, comments left out."""
    at, line = 0, 1
    while at < len(text):
        match = _TOKEN.match(text, at)
        if match is None:
            raise InputError("text", text[at : at + 20], 'a string that ends in "', f"{name}:{line}")
        if match.lastgroup:
            found = match.group()
            is_string = match.lastgroup == "string"
            yield Token(match.lastgroup, found[1:-1] if is_string else found, f"{name}:{line}")
        line += match.group().count("\n")
        at = match.end()


def directives(found: list[Token]) -> Iterator[Directive]:
    """Of tokens: a word that is no number begins one."""
    at = 0
    while at < len(found):
        head = found[at]
        if head.kind != "word" or _NUMBER.fullmatch(head.text):
            raise InputError("text", head.text, "a directive", head.where)
        at += 1
        arguments: list[str] = []
        parameters: dict[str, Parameter] = {}
        while at < len(found) and not (found[at].kind == "word" and not _NUMBER.fullmatch(found[at].text)):
            token = found[at]
            kind, _, name = token.text.partition(" ")
            if token.kind == "string" and name.strip() and kind in (*KINDS, *SPECTRA, "point", "vector", "normal3"):
                values, at = _values(found, at + 1)
                if name.strip() in parameters:
                    raise InputError(f"{head.text} {name.strip()}", "a second time", "one value", token.where)
                parameters[name.strip()] = Parameter(kind, values, token.where)
                continue
            if token.kind != "bracket":
                arguments.append(token.text)
            at += 1
        yield Directive(head.text, tuple(arguments), parameters, head.where)


def _values(found: list[Token], at: int) -> tuple[tuple[str, ...], int]:
    """The values of a parameter from a place on, and where the next token is."""
    if at < len(found) and found[at].text == "[" and found[at].kind == "bracket":
        end = at + 1
        while end < len(found) and found[end].kind != "bracket":
            end += 1
        if end == len(found) or found[end].text != "]":
            raise InputError("text", "[", "a list that ends in ]", found[at].where)
        return tuple(token.text for token in found[at + 1 : end]), end + 1
    if at == len(found):
        raise InputError("text", "a parameter without a value", "its value", found[-1].where)
    return (found[at].text,), at + 1
