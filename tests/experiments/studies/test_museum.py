"""The museum's bugs: each shows in its images at the size they are judged at."""

import numpy as np
import pytest

from nusselt.experiments.defects.museum import MUSEUM
from nusselt.experiments.independent.steps import RIGHT
from nusselt.experiments.studies.museum import SAMPLES, show
from nusselt.experiments.studies.planted_images import images_of

WIDTH = 48


@pytest.mark.parametrize("exhibit", MUSEUM, ids=lambda exhibit: exhibit.mistake.name)
def test_every_bug_shows_at_the_size_of_its_row(exhibit):
    with np.errstate(all="ignore"):
        wrong, right = (
            images_of(exhibit.mistake, steps, WIDTH, (1,), SAMPLES) for steps in (exhibit.mistake.steps, RIGHT)
        )
    assert not np.array_equal(wrong, right)


@pytest.mark.parametrize("name", ["light turned over", "no number in the light's plane"])
def test_a_black_image_and_values_that_are_no_numbers_differ(name):
    number = next(k for k, exhibit in enumerate(MUSEUM) if exhibit.mistake.name == name)
    (row,) = show(number, WIDTH, 7).rows
    assert row["verdict"] == "differs", row["reason"]
    assert row["as_claimed"]
