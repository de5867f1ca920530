"""Whether a scene reflects at its backs, of files that say it for each surface: ours do all or none."""

from __future__ import annotations

from collections.abc import Sequence

from nusselt.renderer.camera.rays import pixel_centres
from nusselt.renderer.camera.view import look
from nusselt.renderer.errors import InputError
from nusselt.renderer.geometry.arrays import build_geometry
from nusselt.renderer.scene import Scene


def two_sided(scene: Scene, sides: Sequence[bool], argument: str, where: str) -> bool:
    """What counts is the backs that are seen.

    Parameters
    ----------
    sides : sequence of bool
        Of each mesh, then of each ellipsoid: whether its back reflects.
    argument, where : str
        What an error calls the property, and the file.

    Raises
    ------
    InputError
        If backs of both kinds are seen.
    """
    if len(set(sides)) < 2:
        return any(sides)
    geometry = build_geometry(scene)
    x, y = pixel_centres(range(scene.width), range(scene.height))
    view = look(scene, geometry, x, y)
    seen = {sides[k] for k in view.hits.surface[view.back].tolist()}
    if seen == {True, False}:
        accepted = "surfaces that reflect at their back all, or none, where that is seen"
        raise InputError(argument, "seen from behind, beside a surface that is not", accepted, where)
    return seen != {False}
