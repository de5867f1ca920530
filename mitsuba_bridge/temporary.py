"""Temporary folders for what Mitsuba's process is given and gives: one without room is named before it starts."""

from __future__ import annotations

import errno
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager

from .process import ReferenceUnavailable

LEAST = 1 << 18
"""Bytes that every job has room for."""
UNFIT = {errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EROFS, errno.EACCES, errno.ENOENT}
"""What systems say of a folder that is full, read-only or not there."""


@contextmanager
def temporary_folder(needed: int = LEAST) -> Iterator[str]:
    """A folder with room for so many bytes; `ReferenceUnavailable` names one that has none."""
    try:
        with tempfile.TemporaryDirectory(prefix="nusselt-") as name:
            free = shutil.disk_usage(name).free
            if free < needed:
                raise OSError(errno.ENOSPC, f"it has room for {free / 1e6:.1f} MB of {needed / 1e6:.1f}")
            yield name
    except OSError as error:
        if error.errno not in UNFIT:
            raise
        where = tempfile.tempdir or "/tmp"
        told = f"the temporary folder {where} cannot hold Mitsuba's files: {error.strerror}"
        raise ReferenceUnavailable(f"{told}; let TMPDIR name another") from error
