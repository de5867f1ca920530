"""Tests import what they share by name: builders in `support`, and helpers of one another."""

import math
import sys
from pathlib import Path

import pytest

from nusselt.experiments import workers

HERE = Path(__file__).parent
for folder in sorted({path.parent for path in HERE.rglob("*.py")}):
    sys.path.insert(0, str(folder))

LONG = (
    *("test_classic.py", "test_every_estimator.py", "test_bring_mistakes.py", "test_studies.py", "test_own.py"),
    *("test_bridge_decisions.py", "test_bring_readme.py", "test_pytest_plugin.py", "test_load.py", "test_wheel.py"),
)
"""Files of a minute and more, first: one that began last would keep a worker alone at the end."""


def pytest_collection_modifyitems(items):
    """The long files first, the others as they were."""
    items.sort(key=lambda item: LONG.index(item.path.name) if item.path.name in LONG else len(LONG))


@pytest.fixture(autouse=True, scope="session")
def no_workers_for_one_image():
    """The suite has a process a core: an image of some seconds starts no more of them, unless a test is about that."""
    patient = workers.PatientPool
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(workers, "PatientPool", lambda count, patience: patient(count, patience and math.inf))
        yield
