"""What a parallelogram reflects where nothing is in the way, in closed form: the sum of the surface's lobes.

Reflected radiance = L sum albedo P, P a lobe's integral over the light's polygon (`Lobe.patch`).
"""

from __future__ import annotations

from nusselt.renderer.errors import InputError
from nusselt.renderer.lobes import Lobe
from nusselt.renderer.shading import ShadingPoints
from nusselt.renderer.vectors import Floats, Ints

from .facing import faced_by
from .lobe_sum import lobe_sum


def quad_patch(points: ShadingPoints, corner: Floats, ab: Floats, ac: Floats, glossy: bool) -> tuple[Floats, Floats]:
    """Light of the parallelogram corner + u ab + v ac, one-sided, of unit radiance.

    Parameters
    ----------
    corner, ab, ac : (3, 1) or (3, n) float64
        Emits on the side of -(ab x ac).

    Returns
    -------
    radiance : (3, n) float64
        Reflected.
    bound : (n,) float64
        Of its relative error; what is below 1e-280 is nothing.

    Raises
    ------
    InputError
        If a lobe has no closed form.
    """
    facing = faced_by(corner, ab, ac, points.position)

    def share(lobe: type[Lobe], k: Ints) -> tuple[Floats, Floats]:
        if lobe.patch is None:
            raise InputError(
                lobe.title, "over a parallelogram", "a lobe with a closed form, or an estimator that samples"
            )
        value, bound = lobe.patch(points, k, corner, ab, ac)
        return value, value * bound

    return lobe_sum(points, facing, glossy, share)
