"""The child's main: `python -m nusselt.mitsuba_bridge.child.worker`.

Reads lines of JSON, [JOB.json, OUT.npz], and does one job after the other. Prints lines of JSON: progress, and after
each job what it ran with. The arrays go to OUT.npz. It ends when nothing is asked of it for a while, and at once when
whoever asks is gone, whatever it is doing.
"""

from __future__ import annotations

import contextlib
import gc
import json
import os
import queue
import sys
import threading
import time
from pathlib import Path
from typing import Any

import numpy as np

from nusselt.mitsuba_bridge.process import IDLE


def say(**words: Any) -> None:
    """One line of JSON to the parent."""
    print(json.dumps(words), flush=True)


def resident() -> int:
    """Bytes of memory in use; 0 where that is not known."""
    try:
        return int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1]) * os.sysconf("SC_PAGE_SIZE")
    except (OSError, ValueError, AttributeError):
        return 0


def do(job_file: str, out_file: str) -> None:
    """Do one job."""
    job = json.loads(Path(job_file).read_text(encoding="utf-8"))
    started = time.perf_counter()
    import mitsuba as mi

    mi.set_variant(job["variant"])
    mi.set_log_level(mi.LogLevel.Error)
    imported = time.perf_counter()
    from . import tasks

    arrays = tasks.TASKS[job["task"]](job, Path(job_file).parent, lambda done, total: say(done=done, total=total))
    np.savez(out_file, allow_pickle=False, **arrays)
    rendered = time.perf_counter()
    del arrays
    gc.collect()  # scenes are cycles
    tasks.forget()
    say(
        version=mi.__version__,
        variant=mi.variant(),
        llvm=tasks.llvm_version(),
        seconds={"import": imported - started, "render": rendered - imported},
        resident=resident(),
    )


def _listen(jobs: queue.Queue[str]) -> None:
    for line in sys.stdin:
        jobs.put(line)
    os._exit(0)


def main() -> None:
    """Do what is asked."""
    jobs: queue.Queue[str] = queue.Queue()
    threading.Thread(target=_listen, args=(jobs,), daemon=True).start()
    with contextlib.suppress(queue.Empty):
        while True:
            do(*json.loads(jobs.get(timeout=IDLE)))


if __name__ == "__main__":
    main()
