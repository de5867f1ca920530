"""How often right images are named: the count is of what the diagnosis says."""

from __future__ import annotations

from nusselt.experiments.external.diagnosis.diagnose import NAMED_WRONGLY, Diagnosis, Mistake
from nusselt.experiments.studies import right_names
from nusselt.experiments.studies.calibration import names_job


def test_right_images_are_given_no_name():
    assert right_names.names_of_right(range(2), 24, seed=1) == []


def test_names_are_counted_and_too_many_are_not_as_claimed(monkeypatch):
    monkeypatch.setattr(right_names, "diagnose", lambda *_: Diagnosis((Mistake("gain", 1.0, ""),)))
    (row,) = names_job(0, 3, seed=1).rows
    assert (row["hits"], row["reports"], row["allowed"]) == (3, 3, NAMED_WRONGLY)
    assert row["reason"] == "gain, gain, gain"
    assert not row["as_claimed"]
    monkeypatch.setattr(right_names, "diagnose", lambda *_: Diagnosis(()))
    (row,) = names_job(0, 3, seed=1).rows
    assert (row["hits"], row["as_claimed"]) == (0, True)
