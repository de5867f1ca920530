"""Which channels of an EXR file are the image: its parts and layers, and the one that is meant."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from .raw import refuse

RGB = (("R", "G", "B"), ("r", "g", "b"), ("red", "green", "blue"), ("Red", "Green", "Blue"))
CHROMA, XYZ, GREY = ("Y", "RY", "BY"), ("X", "Y", "Z"), ("Y",)
SHOWN = 300
"""Letters of a list of names, at most."""


@dataclass(frozen=True)
class Layer:
    """Channels that are an image.

    Parameters
    ----------
    part : int
    prefix : str
        What their names begin with: empty, or a layer's name and a dot.
    names : tuple of str
        Without it, in order: R, G, B or their likes; Y, RY, BY; X, Y, Z; Y.
    label : str
        What the user calls it.
    """

    part: int
    prefix: str
    names: tuple[str, ...]
    label: str

    @property
    def is_rgb(self) -> bool:
        return self.names in RGB

    @property
    def channels(self) -> tuple[str, ...]:
        """Names in the file."""
        return tuple(self.prefix + name for name in self.names)


def layers_of(parts: Sequence[tuple[str, Iterable[str]]]) -> list[Layer]:
    """Every layer of parts (name, channels' names) that can be an image.

    X, Y, Z and Y are colours only where they are in no layer: `Normal.X` is a direction, `Normal.Y` no grey.
    """
    found = []
    for number, (part, channels) in enumerate(parts):
        names = list(channels)
        for prefix in dict.fromkeys(name[: name.rfind(".") + 1] for name in names):
            inside = {name[len(prefix) :] for name in names if name.startswith(prefix)}
            kinds = (*RGB, CHROMA, *(() if prefix else (XYZ, GREY)))
            kind = next((kind for kind in kinds if inside.issuperset(kind)), None)
            if kind:
                layer = prefix.removesuffix(".")
                apart = len(parts) > 1 and part and part != layer
                label = (f"{part}.{layer}" if layer else part) if apart else layer or part or "".join(kind)
                found.append(Layer(number, prefix, kind, label))
    return found


def chosen(path: Path, layers: Sequence[Layer], names: Sequence[str], wanted: str) -> Layer:
    """The layer called ``wanted``; else the only one of colours in no layer; of several parts, the only one of R, G, B;
    else the only one there is.

    Raises
    ------
    InputError
        If there is none, or several that might be meant: with their names.
    """
    if wanted:
        named = [layer for layer in layers if wanted == layer.label]
        if len(named) == 1:
            return named[0]
        raise refuse(path, f"layer {wanted[:80]}", f"one of its layers: {listed(layer.label for layer in layers)}")
    base = [layer for layer in layers if not layer.prefix and (layer.is_rgb or layer.names == CHROMA)]
    apart = len({layer.part for layer in layers}) > 1
    for pool in (base, [layer for layer in layers if layer.is_rgb and apart], layers):
        if len(pool) == 1:
            return pool[0]
        if pool:
            several = listed(layer.label for layer in layers)
            raise refuse(path, f"{len(layers)} layers", f"one of them, named as {path.name}:LAYER: {several}")
    raise refuse(path, f"channels {listed(names)}", "channels R, G, B; Y; Y, RY, BY; or X, Y, Z")


def left_out(taken: Layer, parts: Sequence[tuple[str, Iterable[str]]]) -> tuple[str, ...]:
    """What is to be said of all that was not taken."""
    notes = []
    if taken.prefix or len(parts) > 1:
        notes.append(f"its layer {taken.label} is taken")
    if taken.is_rgb and taken.names != RGB[0]:
        notes.append(f"its channels {', '.join(taken.names)} are taken for red, green and blue")
    if taken.names == GREY:
        notes.append("its grey is taken for three equal channels")
    alphas = {taken.prefix + name for name in ("A", "a", "alpha", "Alpha")}
    others = []
    for number, (part, names) in enumerate(parts):
        seen = {*taken.channels, *alphas} if number == taken.part else set()
        if number == taken.part and alphas & set(names):
            notes.append("its alpha is left out")
        others += [
            name.rpartition(".")[0] or (part if number != taken.part else "") or name
            for name in names
            if name not in seen
        ]
    if others:
        notes.append(f"what else it holds is left out: {listed(others)}")
    return tuple(notes)


def listed(names: Iterable[str]) -> str:
    """Names in a row, cut where they are too many; what cannot be printed is not."""
    text = ", ".join(dict.fromkeys(names)) or "none"
    text = "".join(letter if letter.isprintable() else "?" for letter in text)
    return text if len(text) <= SHOWN else text[:SHOWN].rsplit(", ", 1)[0] + ", …"
