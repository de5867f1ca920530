"""What directives change: the transform, the material, the light that shapes are to be."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from nusselt.renderer.errors import InputError
from nusselt.renderer.surfaces import Material
from nusselt.renderer.vectors import Floats

from .tokens import Directive, number_of

DEFAULT = 0.5
"""Reflectance where none is said."""


@dataclass(frozen=True)
class State:
    """Saved by AttributeBegin, and given back by AttributeEnd."""

    transform: Floats = field(default_factory=lambda: np.eye(4))
    material: Material = field(default_factory=lambda: Material(diffuse=(DEFAULT,) * 3))
    area: Directive | None = None
    inside_out: bool = False

    def turned(self, matrix: Floats) -> State:
        """With a matrix that acts before what there is."""
        return replace(self, transform=self.transform @ matrix)


def _translate(v: Floats) -> Floats:
    matrix = np.eye(4)
    matrix[:3, 3] = v
    return matrix


def _scale(v: Floats) -> Floats:
    return np.diag([*v, 1.0])


def _rotate(v: Floats) -> Floats:
    """Degrees about an axis (Rodrigues)."""
    axis = v[1:] / np.linalg.norm(v[1:])
    x, y, z = axis
    turn = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    angle = np.radians(v[0])
    matrix = np.eye(4)
    matrix[:3, :3] += np.sin(angle) * turn + (1 - np.cos(angle)) * turn @ turn
    return matrix


def _look_at(v: Floats) -> Floats:
    """From the world to a camera that looks along its +z; x is right, y up, left-handed."""
    eye, at, up = v.reshape(3, 3)
    way = (at - eye) / np.linalg.norm(at - eye)
    right = np.cross(up / np.linalg.norm(up), way)
    right = right / np.linalg.norm(right)
    camera = np.eye(4)
    camera[:3] = np.stack((right, np.cross(way, right), way, eye), axis=1)
    return np.linalg.inv(camera)


def _matrix(v: Floats) -> Floats:
    """Written column by column."""
    return v.reshape(4, 4).T


MOVES = {
    "Translate": (_translate, 3),
    "Scale": (_scale, 3),
    "Rotate": (_rotate, 4),
    "LookAt": (_look_at, 9),
    "ConcatTransform": (_matrix, 16),
    "Transform": (_matrix, 16),
    "Identity": (lambda v: np.eye(4), 0),
}
"""Directives that change the transform, and how many numbers they take."""
ANEW = ("Transform", "Identity")
"""Those that put theirs in its place."""


def move(state: State, directive: Directive) -> State:
    """The state after a directive of `MOVES`."""
    make, count = MOVES[directive.name]
    values = np.array([number_of(text, directive.name, directive.where) for text in directive.arguments])
    if values.size != count:
        raise InputError(directive.name, f"{values.size} numbers", f"{count} numbers", directive.where)
    with np.errstate(all="ignore"):
        try:
            matrix = make(values)
            flat = (
                not np.isfinite(matrix).all() or np.linalg.matrix_rank(matrix) < 4 or (matrix[3] != (0, 0, 0, 1)).any()
            )
        except np.linalg.LinAlgError:
            flat = True
    if flat:
        raise InputError(
            directive.name, " ".join(directive.arguments), "an affine transform, not flat", directive.where
        )
    return replace(state, transform=matrix) if directive.name in ANEW else state.turned(matrix)
