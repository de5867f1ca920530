"""Which places in the image show faces of a few pixels, and their shadows from as few evaluations as it takes."""

from __future__ import annotations

import numpy as np

from nusselt.renderer.needs import Needs
from nusselt.renderer.vectors import Bools, Floats, Ints

from .regions import Regions
from .shade import Shader, unshadowed
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


def bodies(regions: Regions, region: Ints) -> Ints:
    """The surface of the scene's table that each region (n,) is a face of; -1 for what is round."""
    faces, surface = regions.faces, region % max(regions.surfaces, 1)
    flat = surface < faces.count
    found = np.full(region.size, -1)
    found[flat] = regions.geometry.triangle_surface[faces.triangle[surface[flat]]]
    return found


def fitted(
    regions: Regions,
    needs: Needs,
    shade: Shader,
    place: tuple[Floats, Floats, Ints, Floats],
    doubt: Floats,
    asked: tuple[float, float],
) -> Places:
    """Radiance of places on small faces.

    Parameters
    ----------
    place : tuple of (n,) arrays
        Image points, regions, and shares of their pixels.
    doubt : (n,) float64
        Of the unshadowed radiance, what a shadow that fits in a pixel there may be worth.
    asked : (tolerance, others)
        See `fit_shadows`.
    """
    x, y, region, area = place
    free = unshadowed(regions, needs, x, y, region)
    _, face = np.unique(region, return_inverse=True)
    worst = np.zeros(int(face.max(initial=-1)) + 1)
    np.maximum.at(worst, face, doubt)
    lost = worst[face] * np.sqrt((free**2).sum(axis=0))
    places = Places.of(x, y, area, face, bodies(regions, region), free, lost)
    fit_shadows(places, lambda k: shade(x[k], y[k], region[k]), *asked)
    return places
