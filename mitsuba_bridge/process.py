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
from collections.abc import Callable
from pathlib import Path
from typing import Any

Progress = Callable[[int, int], None]
KEPT = 4000
"""Characters of the child's last words that are kept."""


class ReferenceUnavailable(RuntimeError):
    """Mitsuba could not give a reference; the message says why in a plain sentence."""


def environment(llvm: Path | None) -> dict[str, str]:
    """The child's environment: Dr.Jit reads these when it is imported, and never again."""
    kept = {k: v for k, v in os.environ.items() if k != "DRJIT_LIBLLVM_PATH"}
    if llvm is not None:
        kept["DRJIT_LIBLLVM_PATH"] = str(llvm)
    return kept


def _pump(stream: Any, lines: queue.Queue[str | None]) -> None:
    with contextlib.suppress(ValueError, OSError):
        for line in stream:
            lines.put(line)
    lines.put(None)


def end(process: subprocess.Popen[str]) -> None:
    """Kill a child and everything it started."""
    with contextlib.suppress(ProcessLookupError, PermissionError):
        os.killpg(process.pid, signal.SIGKILL)
    with contextlib.suppress(subprocess.TimeoutExpired):
        process.wait(10)


def _fate(code: int, words: str) -> str:
    last = [line.strip() for line in words.splitlines() if line.strip()]
    said = f": {last[-1][:300]}" if last else ""
    if code < 0:
        try:
            return f"Mitsuba's process was ended by {signal.Signals(-code).name}{said}"
        except ValueError:
            pass
    return f"Mitsuba's process ended with status {code}{said}"


def run_child(
    arguments: list[str], llvm: Path | None, timeout: float, progress: Progress | None = None
) -> dict[str, Any]:
    """Run a Python module in a child and return the last JSON object it printed.

    Parameters
    ----------
    arguments : list of str
        For the interpreter.
    llvm : Path or None
        The LLVM library it is to use.
    timeout : float
        Seconds, for all of it.
    progress : callable, optional
        Called for each line {"done": d, "total": t} the child prints.

    Raises
    ------
    ReferenceUnavailable
        If it cannot be started, aborts, takes too long, or prints no result.
    """
    try:
        process = subprocess.Popen(
            [sys.executable, *arguments],
            env=environment(llvm),
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            encoding="utf-8",
            errors="replace",
            start_new_session=True,
        )
    except OSError as error:
        raise ReferenceUnavailable(f"no process for Mitsuba could be started ({error.strerror})") from error
    lines: queue.Queue[str | None] = queue.Queue()
    words: queue.Queue[str | None] = queue.Queue()
    for stream, sink in ((process.stdout, lines), (process.stderr, words)):
        threading.Thread(target=_pump, args=(stream, sink), daemon=True).start()
    try:
        result = _listen(process, lines, time.monotonic() + timeout, timeout, progress)
        code = process.wait(10)
    except subprocess.TimeoutExpired:
        raise ReferenceUnavailable("Mitsuba's process finished and did not end") from None
    finally:
        end(process)
    if code != 0:
        raise ReferenceUnavailable(_fate(code, _drain(words)))
    if result is None:
        raise ReferenceUnavailable("Mitsuba's process ended without a result")
    return result


def _listen(
    process: subprocess.Popen[str],
    lines: queue.Queue[str | None],
    deadline: float,
    timeout: float,
    progress: Progress | None,
) -> dict[str, Any] | None:
    result = None
    while True:
        try:
            line = lines.get(timeout=max(0.0, deadline - time.monotonic()))
        except queue.Empty:
            told = f"Mitsuba took more than {timeout:g} s and was ended: a longer --timeout gives it more"
            raise ReferenceUnavailable(told) from None
        if line is None:
            return result
        try:
            told = json.loads(line)
        except ValueError:
            continue  # a library's own chatter
        if not isinstance(told, dict):
            continue
        if {"done", "total"} <= told.keys():
            if progress is not None:
                progress(int(told["done"]), int(told["total"]))
        else:
            result = told


def _drain(words: queue.Queue[str | None]) -> str:
    found: list[str] = []
    with contextlib.suppress(queue.Empty):
        while (line := words.get(timeout=1.0)) is not None:
            found.append(line)
    return "".join(found)[-KEPT:]
