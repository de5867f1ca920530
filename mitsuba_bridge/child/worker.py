"""The child's main: `python -m nusselt.mitsuba_bridge.child.worker JOB.json OUT.npz`.

Prints lines of JSON: progress, and at the end what it ran with. The arrays go to OUT.npz.
"""

from __future__ import annotations

import json
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np


def say(**words: Any) -> None:
    """One line of JSON to the parent."""
    print(json.dumps(words), flush=True)


def main(job_file: str, out_file: str) -> None:
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
    say(
        version=mi.__version__,
        variant=mi.variant(),
        llvm=tasks.llvm_version(),
        seconds={"import": imported - started, "render": time.perf_counter() - imported},
    )


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2])
