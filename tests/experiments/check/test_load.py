"""Small checks without end: neither memory nor open files grow; ten thousand are done by `load.py`."""

from __future__ import annotations

import pytest
from load import small_checks

pytestmark = pytest.mark.mitsuba


def test_many_small_checks_leave_nothing_behind():
    """What is kept of each, were it only its image, would be 16 KB: 1.6 MB over the later half."""
    marks = small_checks(200, marks=4)
    (_, memory, files), (_, last_memory, last_files) = marks[1], marks[-1]
    assert last_files <= files
    assert last_memory <= memory + 1_000_000
