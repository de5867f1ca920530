"""A light in the scene text: its numbers in the order of its fields, read and written alike for all kinds."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields
from typing import Any, TypeVar

Kind = TypeVar("Kind")


@dataclass(frozen=True)
class Text:
    """A command of the scene text that stands for one kind of light.

    Parameters
    ----------
    command : str
    arguments : str
        One word for each field of the light, in their order: ``name:xyz`` a point or direction, ``name:rgb`` a colour,
        ``name`` a number.
    of_surface : bool
        Whether the light's first field is a mesh, that of the triangles which the text names after the command.
    """

    command: str
    arguments: str
    of_surface: bool = False

    @property
    def widths(self) -> tuple[int, ...]:
        """How many numbers each field takes."""
        return tuple(3 if ":" in word else 1 for word in self.arguments.split())


def numbers(light: Any) -> tuple[float, ...]:
    """A light's numbers, as its command gives them."""
    values: list[float] = []
    for entry, width in zip(_said(light), light.TEXT.widths, strict=True):
        value = getattr(light, entry.name)
        values += value if width == 3 else [value]
    return tuple(values)


def _said(light: Any) -> Sequence[Any]:
    """The fields that the command's numbers are."""
    return fields(light)[light.TEXT.of_surface :]


def surface_of(light: Any) -> Any:
    """The surface of a light that is ``of_surface``."""
    return getattr(light, fields(light)[0].name)


def from_numbers(kind: Callable[..., Kind], text: Text, values: Sequence[float], *surface: Any) -> Kind:
    """The light of a kind that those numbers, and its surface if it is ``of_surface``, stand for."""
    left, given = list(values), [*surface]
    for width in text.widths:
        given.append(tuple(left[:3]) if width == 3 else left[0])
        del left[:width]
    return kind(*given)


def vector_fields(light: Any) -> tuple[str, ...]:
    """The fields that hold a point or a direction."""
    words = light.TEXT.arguments.split()
    return tuple(entry.name for entry, word in zip(_said(light), words, strict=True) if word.endswith(":xyz"))
