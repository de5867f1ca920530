"""Numbers, nouns and verbs agree."""

import pytest

from nusselt.renderer.words import count


@pytest.mark.parametrize(
    ("number", "noun", "verb", "said"),
    [
        (1, "pixel", "is", "1 pixel is"),
        (2, "pixel", "is", "2 pixels are"),
        (0, "pixel", "shows", "0 pixels show"),
        (1, "pass", "", "1 pass"),
        (3, "pass", "has", "3 passes have"),
        (2, "geometry", "", "2 geometries"),
        (2, "ray", "differs", "2 rays differ"),
    ],
)
def test_they_agree(number, noun, verb, said):
    assert count(number, noun, verb) == said
