"""A temporary folder that is small, or not there, is named before Mitsuba starts."""

from __future__ import annotations

import shutil
import tempfile
from types import SimpleNamespace

import pytest

from nusselt.mitsuba_bridge.process import ReferenceUnavailable
from nusselt.mitsuba_bridge.temporary import temporary_folder

NEEDED = 300_000


@pytest.mark.parametrize("spare", [0, -1])
def test_a_folder_without_room_for_the_arrays_is_named(spare, tmp_path, monkeypatch):
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    free = NEEDED + spare
    monkeypatch.setattr(shutil, "disk_usage", lambda path: SimpleNamespace(free=free))
    if spare == 0:
        with temporary_folder(NEEDED) as name:
            assert name.startswith(str(tmp_path))
    else:
        with (
            pytest.raises(ReferenceUnavailable, match=rf"{tmp_path} .* room for 0\.3 MB.*TMPDIR"),
            temporary_folder(NEEDED),
        ):
            pass


def test_a_folder_that_is_not_there_is_named(tmp_path, monkeypatch):
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "none"))
    with (
        pytest.raises(ReferenceUnavailable, match=f"{tmp_path / 'none'} cannot hold.*TMPDIR"),
        temporary_folder(NEEDED),
    ):
        pass
