"""What is said of images that are not finite, and where next to nothing could have been found."""

from __future__ import annotations

import io
from types import SimpleNamespace

import numpy as np
import pytest
from rich.console import Console

from nusselt.experiments.external.convergence import convergence, error_row
from nusselt.experiments.external.tell import tell


def told(row: dict) -> str:
    page = io.StringIO()
    tell(row, Console(file=page, width=200))
    return page.getvalue()


@pytest.fixture
def row() -> dict:
    """Of images of which a part is not finite."""
    return {
        **{
            "scene": "room",
            "passes": 2,
            "reference": {"notes": ["the exact image"]},
            "warnings": [],
            "command": "again",
        },
        **{"verdict": "differs", "reason": "600 pixels are not finite", "non_finite": 600, "pixels": {"shaded": 500}},
        **{"minimum_detectable_bias": 0.05, "finds": {"contrast": 0.06, "rms": 0.08, "pixel": 1.41}},
        **{"course_expected": {}, "course_scores": [], "likely_mistakes": [], "where": []},
    }


def test_what_is_not_finite_is_said_with_its_usual_causes(row):
    words = told(row)
    assert "not finite" in words
    assert "0 / 0" in words
    assert "none of the mistakes" not in words
    assert "a bias of 5.00%, a contrast of 6.00%, an RMS of 8.00%, no pixel below 100 %" in words
    assert "none of the mistakes" in told(row | {"non_finite": 0})


def test_nothing_is_said_to_be_found_where_nothing_can_be(row):
    blind = row | {"minimum_detectable_bias": 1550.14, "finds": {"contrast": 3.0, "rms": 0.5, "pixel": None}}
    assert "would have been found, with 99 % power: an RMS of 50.00%, no bias, no contrast below 100 %" in told(blind)
    empty = row | {"pixels": row["pixels"] | {"shaded": 0}}
    assert "nothing would have been found" in told(empty)


def test_an_error_of_no_finite_pixel_is_none_and_no_warning(row):
    plane, truth = np.zeros((4, 5)), np.ones((3, 4, 5))
    seen = SimpleNamespace(shaded=plane == 0, unjudged=plane > 0)
    run = SimpleNamespace(samples=4, seconds=0.1)
    reference = SimpleNamespace(mean=truth, pixel_standard_error=plane)
    made = error_row([run], lambda run: np.full((3, 4, 5), np.nan), seen, reference)
    assert np.isnan(made["rms_relative"])
    rows = [made | {"seconds_first": 0.1, "seconds_median": 0.1}]
    words = told(row | {"convergence": {"rows": rows, "slope_samples": None, "slope_seconds": None}})
    assert "none" in words
    assert "nan" not in words


def test_a_time_that_is_all_start_up_has_no_slope():
    truth, plane = np.ones((3, 4, 5)), np.zeros((4, 5))
    seen = SimpleNamespace(shaded=plane == 0, unjudged=plane > 0)
    reference = SimpleNamespace(mean=truth, pixel_standard_error=plane)
    quantiser = SimpleNamespace(decode=lambda raw: truth + raw)

    def found(*seconds):
        runs = [[SimpleNamespace(samples=4**k, seconds=s, raw=0.5**k)] for k, s in enumerate(seconds)]
        return convergence(runs, quantiser, seen, reference)

    assert found(1.0, 1.1, 1.6)["slope_seconds"] is None
    assert found(1.0, 4.0, 16.0)["slope_seconds"] == pytest.approx(-0.5)
    assert found(1.0, 1.1, 1.6)["slope_samples"] == pytest.approx(-0.5)
