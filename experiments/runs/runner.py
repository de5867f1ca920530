"""Jobs over any executor; what is finished is kept at once and never done again."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import Executor, as_completed

from nusselt.experiments.results.document import plain
from nusselt.experiments.results.store import Store

from .experiment import Job, Outcome
from .store import finish, finished

Progress = Callable[[int, int], None]


def do(job: Job) -> Outcome:
    """Run a job; what a worker is sent."""
    return job.function(**job.arguments)


def run_jobs(
    jobs: Sequence[Job], store: Store, executor: Executor | None = None, progress: Progress | None = None
) -> list[Outcome]:
    """Outcomes in the order of the jobs.

    Parameters
    ----------
    executor : Executor, optional
        Where jobs run that share the machine; the others run here when those are done.
    progress : callable, optional
        Called with (jobs done, jobs in all).
    """
    found = [finished(store, job) for job in jobs]

    def keep(index: int, outcome: Outcome) -> None:
        plainly = Outcome(plain(outcome.rows), outcome.arrays)  # the same whether it was just found or read again
        finish(store, jobs[index], plainly)
        found[index] = plainly
        tell()

    def tell() -> None:
        if progress:
            progress(sum(outcome is not None for outcome in found), len(jobs))

    tell()
    left = [index for index, outcome in enumerate(found) if outcome is None]
    shared = [] if executor is None else [index for index in left if not jobs[index].alone]
    if executor is not None and shared:
        futures = {executor.submit(do, jobs[index]): index for index in shared}
        try:
            for future in as_completed(futures):
                keep(futures[future], future.result())
        finally:
            for future in futures:
                future.cancel()
    for index in left:
        if found[index] is None:
            keep(index, do(jobs[index]))
    return [outcome for outcome in found if outcome is not None]
