"""A peer's adapter kept running: image after image, where starting it would take longer than an image."""

from __future__ import annotations

import atexit
import contextlib
import json
import selectors
import subprocess
import time

from nusselt.experiments.external.program import ProgramFailed, end
from nusselt.renderer.errors import InputError

SERVE = "serve"
"""An adapter's only word: then it reads jobs, a line of JSON each."""
DONE, FAILED = "nusselt-peer: done", "nusselt-peer: failed: "
"""What it says of each, whatever its renderer says before."""


class Workshop:
    """An adapter's process, started with its first job, and anew if it has ended; `close` ends it.

    Parameters
    ----------
    launch : list of str
        Words that run the adapter.
    """

    def __init__(self, launch: list[str]) -> None:
        self.launch = launch
        self._process: subprocess.Popen[bytes] | None = None
        atexit.register(self.close)

    def do(self, words: list[str], timeout: float) -> None:
        """One job, its words as the adapter's arguments would be.

        Raises
        ------
        InputError
            If it cannot be started.
        ProgramFailed
            If it fails, ends, or takes too long.
        """
        process = self._started()
        with contextlib.suppress(OSError):  # of one that has ended, and says why
            process.stdin.write(json.dumps(words).encode() + b"\n")  # type: ignore[union-attr]
        self._await(process, time.monotonic() + timeout, timeout)

    def _started(self) -> subprocess.Popen[bytes]:
        if self._process is None:
            try:
                self._process = subprocess.Popen(
                    [*self.launch, SERVE],
                    stdin=subprocess.PIPE,
                    stdout=subprocess.PIPE,
                    stderr=subprocess.STDOUT,
                    start_new_session=True,
                    bufsize=0,  # what is buffered would be waited for
                )
            except (OSError, ValueError) as error:
                told = getattr(error, "strerror", None) or str(error)
                raise InputError("renderer", self.launch[0], f"a program that can be started ({told})") from error
        return self._process

    def _await(self, process: subprocess.Popen[bytes], until: float, timeout: float) -> None:
        """Read what it says until it has done its job."""
        last = ""
        with selectors.DefaultSelector() as ready:
            ready.register(process.stdout, selectors.EVENT_READ)  # type: ignore[arg-type]
            while ready.select(max(until - time.monotonic(), 0.0)):
                said = process.stdout.readline().decode("utf-8", "replace")  # type: ignore[union-attr]
                line = said.strip()
                if line == DONE:
                    return
                if line.startswith(FAILED):
                    raise ProgramFailed(line.removeprefix(FAILED))
                if not said:
                    status = process.wait()
                    self.close()
                    raise ProgramFailed(f"the renderer ended with status {status}{last and f': {last[:200]}'}")
                last = line or last
        self.close()
        raise ProgramFailed(f"the renderer took more than {timeout:g} s and was ended")

    def close(self) -> None:
        """End it, if it runs."""
        if self._process is not None:
            end(self._process)
            for stream in (self._process.stdin, self._process.stdout):
                stream.close()  # type: ignore[union-attr]
            self._process = None
