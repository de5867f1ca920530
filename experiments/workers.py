"""Worker processes for tiles: one a core, started once per command, replaced when they die."""

from __future__ import annotations

import multiprocessing
import os
import re
import signal
import threading
import time
import warnings
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from multiprocessing.connection import Connection, wait
from typing import Any

from nusselt.renderer.errors import InputError, WorkerLost

from .main_script import portable, unguarded

PATIENCE = 1.0
"""Seconds of work on images that are done here before workers are started: about what starting them takes."""
ANSWER = 10.0
"""Seconds within which a scheduler must answer."""
LIVES = 3
"""Deaths in a row, with no work finished between them, that are taken for the work's own doing."""


def cores() -> int:
    """Processors this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _begin(end: Connection) -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent hears Ctrl-C and ends the pool
    threading.Thread(target=_end_with_parent, args=(end,), daemon=True).start()


def _end_with_parent(end: Connection) -> None:
    """A worker whose parent was killed, or has had enough, ends at once, whatever it is at.

    It would wait for work for ever: it holds both ends of its pipe of work itself. Of this one the parent alone has the
    other end.
    """
    parent = multiprocessing.parent_process()
    wait([end] if parent is None else [end, parent.sentinel])
    os._exit(1)


def _cancel(outer: Future[Any]) -> None:
    outer.cancel()
    outer.set_running_or_notify_cancel()


def _settle(outer: Future[Any], inner: Future[Any]) -> None:
    """Hand on what became of the inner future, unless nobody waits for it any more."""
    if inner.cancelled():
        outer.cancel()
    if not outer.set_running_or_notify_cancel():
        return
    error = inner.exception()
    if error is not None:
        outer.set_exception(error)
    else:
        outer.set_result(inner.result())


class SturdyPool(Executor):
    """A process pool that survives its workers: work lost with a killed one is done again in a new pool.

    Workers are started afresh rather than forked: the parent runs a progress thread.
    """

    def __init__(self, count: int) -> None:
        self._count, self._lock, self._deaths, self._ended = count, threading.Lock(), 0, False
        self._heard, self._end = multiprocessing.get_context("spawn").Pipe(duplex=False)
        self._pool = self._start()

    def _start(self) -> ProcessPoolExecutor:
        context = multiprocessing.get_context("spawn")
        return ProcessPoolExecutor(self._count, mp_context=context, initializer=_begin, initargs=(self._heard,))

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        """Schedule a call; it must give the same result when it is made twice."""
        outer: Future[Any] = Future()
        self._try(outer, lambda pool: pool.submit(fn, *args, **kwargs))
        return outer

    def _try(self, outer: Future[Any], start: Callable[[ProcessPoolExecutor], Future[Any]]) -> None:
        def finished(inner: Future[Any]) -> None:
            error = None if inner.cancelled() else inner.exception()
            if isinstance(error, BrokenProcessPool):
                self._retry(outer, pool, start)
            else:
                self._deaths = 0
                _settle(outer, inner)

        pool = self._pool
        try:
            inner = start(pool)
        except BrokenProcessPool:
            self._retry(outer, pool, start)
            return
        except RuntimeError:  # shut down meanwhile
            _cancel(outer)
            return
        inner.add_done_callback(finished)

    def _retry(
        self, outer: Future[Any], broken: ProcessPoolExecutor, start: Callable[[ProcessPoolExecutor], Future[Any]]
    ) -> None:
        with self._lock:
            ended = self._ended  # a pool that is being ended may look broken; nothing is started anew then
            if self._pool is broken and not ended:
                self._deaths += 1
                self._pool = self._start()
            hopeless = self._deaths >= LIVES
        if ended:
            _cancel(outer)
        elif not hopeless:
            self._try(outer, start)
        elif outer.set_running_or_notify_cancel():
            told = f"worker processes died {LIVES} times in a row: out of memory, or killed from outside"
            outer.set_exception(WorkerLost(told))

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """End the workers."""
        with self._lock:
            self._ended = True
        self._pool.shutdown(wait=wait, cancel_futures=cancel_futures)

    def stop(self) -> None:
        """End the workers now: what they are at is lost."""
        with self._lock:
            self._ended = True
        self._end.close()
        self._pool.shutdown(wait=True, cancel_futures=True)


@contextmanager
def cluster(address: str) -> Iterator[Executor]:
    """An executor over a running Dask cluster; work of a lost worker is done again elsewhere.

    Raises
    ------
    InputError
        If `distributed` is not installed, or nobody answers at the address.
    """
    try:
        from distributed import Client
    except ImportError as error:
        raise InputError("cluster", address, "the package distributed: pip install 'nusselt[cluster]'") from error
    wrong = InputError("cluster", address, "the address of a running Dask scheduler (tcp://host:8786)")
    if not re.fullmatch(r"[a-z]+://\S+:\d+", address):
        raise wrong
    try:
        client = Client(address, timeout=ANSWER, set_as_default=False)
    except (OSError, ValueError) as error:
        raise wrong from error
    with client:
        # pure: equal calls would be merged into one.
        yield client.get_executor(pure=False, retries=LIVES)


class PatientPool(Executor):
    """Work is done here until there has been more than some seconds of it; only then are workers started.

    A small image never waits for processes that take longer to start than it takes to render.

    Parameters
    ----------
    count : int
        Workers.
    patience : float
        Seconds.
    """

    def __init__(self, count: int, patience: float) -> None:
        self._count, self._patience, self._spent = count, patience, 0.0
        self._pool: SturdyPool | None = None
        self._here = False

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        """Schedule a call, or make it here and now."""
        workers = self._workers() if portable((fn, *args)) else None
        if workers is not None:
            return workers.submit(fn, *args, **kwargs)
        started = time.perf_counter()
        future = _made_here(fn, args, kwargs)
        self._spent += time.perf_counter() - started
        return future

    def _workers(self) -> SturdyPool | None:
        """The workers, started once there has been enough work; None where there are none, or there must be none."""
        if self._pool is None and not self._here and self._spent >= self._patience:
            problem = unguarded()
            if problem:
                warnings.warn(problem, stacklevel=3)
                self._here = True
            else:
                self._pool = SturdyPool(self._count)
        return self._pool

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """End the workers, if there are any."""
        if self._pool is not None:
            self._pool.shutdown(wait=wait, cancel_futures=cancel_futures)

    def stop(self) -> None:
        """End the workers now, if there are any."""
        if self._pool is not None:
            self._pool.stop()


def _made_here(fn: Callable[..., Any], args: tuple[Any, ...], kwargs: dict[str, Any]) -> Future[Any]:
    future: Future[Any] = Future()
    try:
        future.set_result(fn(*args, **kwargs))
    except Exception as error:  # the caller's, when it asks for the result
        future.set_exception(error)
    return future


@contextmanager
def worker_pool(address: str | None = None, patience: float = 0.0) -> Iterator[Executor | None]:
    """An executor over all cores, or over a Dask cluster; None on a single core, where it would only cost.

    Parameters
    ----------
    address : str, optional
        Of a Dask scheduler.
    patience : float
        Seconds of work that are done here before workers are started; for images, whose tiles are small.
    """
    if address is not None:
        with cluster(address) as remote:
            yield remote
        return
    count = cores()
    if count == 1:
        yield None
        return
    pool = PatientPool(count, patience)
    try:
        yield pool
    except BaseException:  # nobody waits for what the workers are at, which may take minutes
        pool.stop()
        raise
    pool.shutdown(wait=True, cancel_futures=True)
