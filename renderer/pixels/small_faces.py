"""Which places in the image show faces of a few pixels, and their shadows from as few evaluations as it takes."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from nusselt.renderer.needs import Needs
from nusselt.renderer.vectors import Bools, Ints

from .moments import Pieces
from .refine import UNSEEN, Items
from .regions import Regions
from .shade import Shader
from .shadow_fits import Places, fit_shadows

LARGEST = 64
"""Places that show a small face, at most."""
LEAST = 64
"""Small faces of a surface, below which each is left to itself."""


def on_small_faces(face: Ints, body: Ints) -> Bools:
    """Which places (n,) show one of many small faces of a body; both are numbers, of no body below 0."""
    _, first, place, count = np.unique(face, return_index=True, return_inverse=True, return_counts=True)
    body = body[first]
    small = (count <= LARGEST) & (body >= 0)
    many = np.bincount(body[small], minlength=int(body.max(initial=0)) + 1) >= LEAST
    return np.asarray((small & many[np.maximum(body, 0)])[place])


def surfaces_of(regions: Regions, region: Ints) -> Ints:
    """The surface of the scene's table that each region (n,) is a face of; -1 for what is round."""
    faces, surface = regions.faces, region % max(regions.surfaces, 1)
    flat = surface < faces.count
    found = np.full(region.size, -1)
    found[flat] = regions.geometry.triangle_surface[faces.triangle[surface[flat]]]
    return found


@dataclass(frozen=True, eq=False)
class SmallFaces:
    """Places in an image that show small faces.

    Parameters
    ----------
    pixel : (k,) int64
        Whole pixels.
    region : (k,) int64
        Theirs.
    pieces : Pieces
        m pieces of others.
    others : (j,) int64
        The pieces that are not.
    label : (m + j,) int64
        Of all pieces: alike for small faces of one body.
    doubt : (k + m,) bool
        Where a shadow may fit in a pixel.
    """

    pixel: Ints
    region: Ints
    pieces: Pieces
    others: Ints
    label: Ints
    doubt: Bools

    @classmethod
    def of(cls, regions: Regions, region: Ints, pieces: Pieces, alone: Bools, own: Bools) -> SmallFaces | None:
        """Those among whole pixels' regions (h, w), of none below 0, and pieces; None where there are none."""
        if regions.faces.count < LEAST:
            return None
        every = np.flatnonzero(region >= 0)
        which = np.append(region.ravel()[every], pieces.region)
        body = surfaces_of(regions, which)
        small = on_small_faces(which, body)
        if not small.any():
            return None
        pixel, piece = every[small[: every.size]], np.flatnonzero(small[every.size :])
        return cls(
            pixel,
            region.ravel()[pixel],
            pieces.take(piece),
            np.flatnonzero(~small[every.size :]),
            np.where(small, -2 - body, which)[every.size :],
            np.append(alone.ravel()[pixel], own[piece]),
        )

    def items(self, regions: Regions, needs: Needs, shade: Shader, asked: tuple[float, float]) -> Items:
        """With what `fit_shadows` finds of them; ``asked`` are its tolerance and others."""
        nothing = np.zeros((1, self.doubt.size))
        items = Items.of(self.pixel, self.region, self.pieces, nothing, regions.lens.width)
        x, y, region, area = items.x, items.y, items.region, items.area
        free = shade.free(regions, needs, x, y, region)
        most = UNSEEN * np.sqrt((free**2).sum(axis=0))
        _, face = np.unique(region, return_inverse=True)
        worst = np.zeros(int(face.max()) + 1)
        np.maximum.at(worst, face, 1.0 * self.doubt)
        places = Places.of(x, y, area, face, surfaces_of(regions, region), free, worst[face] * most)
        fit_shadows(places, lambda k: shade(x[k], y[k], region[k]), *asked)
        lost = np.where(self.doubt, places.worth * most, 0.0)
        estimate = np.maximum(places.error / np.where(places.known, 1.0, np.sqrt(area)), lost) * area
        return replace(items, value=places.value, estimate=estimate, lost=lost * area)
