"""A mistake is seen beside a right image of the same size, or noise hides it; both are counted apart."""

from __future__ import annotations

from nusselt.experiments.independent.mistakes import MISTAKES
from nusselt.experiments.studies.metamorphic_mistakes import BESIDE, plant


def test_mistakes_are_judged_beside_a_right_image_too():
    numbers = {mistake.name: number for number, mistake in enumerate(MISTAKES)}
    found = {name: plant(numbers[name], 16, 1).rows[0]["checks"] for name in ("no surface cosine", "half vector")}
    assert found["no surface cosine"][BESIDE] == "differs"
    assert found["half vector"][BESIDE] in ("differs", "undecided")
