"""Mitsuba runs in a child process: one that aborts, hangs or babbles is a sentence, never a dead harness."""

from __future__ import annotations

import contextlib
import json
import os
import queue
import signal
import subprocess
import sys
import threading
import time
from collections import deque
from collections.abc import Callable
from pathlib import Path
from typing import Any

Progress = Callable[[int, int], None]
IDLE = 60.0
"""Seconds without a job after which a child ends."""
KEPT = 50
"""Lines of the child's last words that are kept."""


class ReferenceUnavailable(RuntimeError):
    """Mitsuba could not give a reference; the message says why in a plain sentence."""


def environment(llvm: Path | None) -> dict[str, str]:
    """The child's environment: Dr.Jit reads these when it is imported, and never again."""
    kept = {k: v for k, v in os.environ.items() if k != "DRJIT_LIBLLVM_PATH"}
    if llvm is not None:
        kept["DRJIT_LIBLLVM_PATH"] = str(llvm)
    return kept


def _fate(code: int, words: list[str]) -> str:
    last = [line.strip() for line in words if line.strip()]
    said = f": {last[-1][:300]}" if last else ""
    if code < 0:
        try:
            return f"Mitsuba's process was ended by {signal.Signals(-code).name}{said}"
        except ValueError:
            pass
    return f"Mitsuba's process ended with status {code}{said}"


class Child:
    """A Python process that is told things in lines, and answers in lines of JSON.

    Parameters
    ----------
    arguments : list of str
        For the interpreter.
    llvm : Path or None
        The LLVM library it is to use.

    Raises
    ------
    ReferenceUnavailable
        If it cannot be started.
    """

    def __init__(self, arguments: list[str], llvm: Path | None) -> None:
        try:
            self.process = subprocess.Popen(
                [sys.executable, *arguments],
                env=environment(llvm),
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=subprocess.PIPE,
                text=True,
                encoding="utf-8",
                errors="replace",
                start_new_session=True,
            )
        except OSError as error:
            raise ReferenceUnavailable(f"no process for Mitsuba could be started ({error.strerror})") from error
        self._lines: queue.Queue[str | None] = queue.Queue()
        self._words: deque[str] = deque(maxlen=KEPT)
        threading.Thread(target=self._read, daemon=True).start()
        self._hearing = threading.Thread(target=self._hear, daemon=True)
        self._hearing.start()

    def _read(self) -> None:
        with contextlib.suppress(ValueError, OSError):
            for line in self.process.stdout or ():
                self._lines.put(line)
        self._lines.put(None)

    def _hear(self) -> None:
        with contextlib.suppress(ValueError, OSError):
            self._words.extend(self.process.stderr or ())

    def tell(self, line: str) -> bool:
        """Tell it something; whether it could hear it."""
        try:
            print(line, file=self.process.stdin, flush=True)
        except OSError:
            return False
        return True

    def answer(self, timeout: float, progress: Progress | None = None) -> dict[str, Any]:
        """The next JSON object it prints that is no progress.

        Parameters
        ----------
        timeout : float
            Seconds.
        progress : callable, optional
            Called for each line {"done": d, "total": t} until then.

        Raises
        ------
        ReferenceUnavailable
            If it aborts, takes too long, or ends without one.
        """
        deadline = time.monotonic() + timeout
        while True:
            try:
                line = self._lines.get(timeout=max(0.0, deadline - time.monotonic()))
            except queue.Empty:
                told = f"Mitsuba took more than {timeout:g} s and was ended: a longer --timeout gives it more"
                raise ReferenceUnavailable(told) from None
            if line is None:
                raise ReferenceUnavailable(self._end_of_it())
            with contextlib.suppress(ValueError):  # a library's own chatter
                said = json.loads(line)
                if not isinstance(said, dict):
                    continue
                if not {"done", "total"} <= said.keys():
                    return said
                if progress is not None:
                    progress(int(said["done"]), int(said["total"]))

    def _end_of_it(self) -> str:
        try:
            code = self.process.wait(10)
        except subprocess.TimeoutExpired:
            return "Mitsuba's process said no more and did not end"
        self._hearing.join(1.0)
        return _fate(code, list(self._words)) if code else "Mitsuba's process ended without a result"

    def end(self) -> None:
        """Kill it and everything it started."""
        with contextlib.suppress(ProcessLookupError, PermissionError):
            os.killpg(self.process.pid, signal.SIGKILL)
        with contextlib.suppress(subprocess.TimeoutExpired):
            self.process.wait(10)
        for stream in (self.process.stdin, self.process.stdout, self.process.stderr):
            with contextlib.suppress(OSError):
                if stream is not None:
                    stream.close()
