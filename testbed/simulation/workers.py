"""Processes for work that takes hours: one item after the other in each, stopped by Ctrl-C, gone
with their parent.

The first Ctrl-C lets the items at work end in their own way, a second one ends their processes at
once. What a killed process was at is done by another one.
"""

from __future__ import annotations

import os
import signal
import threading
from collections.abc import Callable, Generator, Iterable, Iterator, Mapping
from concurrent.futures import FIRST_COMPLETED, ProcessPoolExecutor
from concurrent.futures import wait as wait_for_answers
from concurrent.futures.process import BrokenProcessPool
from contextlib import closing, contextmanager
from dataclasses import dataclass
from multiprocessing import active_children, get_context, parent_process
from multiprocessing.connection import wait
from multiprocessing.process import BaseProcess
from typing import Any, TypeVar

from testbed.errors import InputError, extra
from testbed.formats.sockets import user_code

Item = TypeVar("Item")
Answer = TypeVar("Answer")
CONNECT_S = 10.0
"""How long a scheduler may take to answer."""
LOOK_S = 0.1
"""How long a Ctrl-C may go unheard while items are waited for."""
_stopped, _at_work = threading.Event(), threading.Event()


@dataclass(frozen=True)
class Workers:
    """Who does the work: processes of this machine, or the workers of a Dask cluster.

    Raises InputError for fewer than one process, and for both at once.
    """

    jobs: int = 1
    cluster: str | None = None
    """Address of the scheduler. Its workers see the same files under the same names, one thread
    each.
    """

    def __post_init__(self) -> None:
        if self.jobs < 1:
            raise InputError("must be at least 1", field="--jobs", value=self.jobs)
        if self.cluster and self.jobs > 1:
            raise InputError(
                "would have no effect: the cluster has its own workers",
                field="--jobs",
                value=self.jobs,
            )

    @classmethod
    def from_environment(cls, jobs: int) -> Workers:
        """So many processes here, unless the environment names a cluster (TESTBED_DASK)."""
        address = os.environ.get("TESTBED_DASK")
        return cls(1, address) if address else cls(jobs)

    def check(self) -> None:
        """Raises InputError where a cluster is named that does not answer."""
        if self.cluster:
            cluster_client(self.cluster).close()


HERE = Workers()


def work_through(
    work: Callable[[Item], Answer],
    items: Iterable[Item],
    workers: Workers = HERE,
    interrupted: Callable[[Answer], bool] = lambda _: False,
) -> Iterator[Answer]:
    """Answers in the order in which they come; KeyboardInterrupt after the items at work, if one
    was interrupted.

    This is the one place that hands out work. A Ctrl-C while they are waited for ends them at once:
    what they had not finished is not done. `work` must be importable and its items picklable.
    """
    todo = list(items)
    if workers.cluster:
        yield from _on_cluster(work, todo, workers.cluster)
        return
    if workers.jobs == 1 or len(todo) < 2:
        for item in todo:
            answer = work(item)
            yield answer
            if interrupted(answer):
                raise KeyboardInterrupt
        return
    yield from _in_processes(work, todo, min(workers.jobs, len(todo)), interrupted)


def cluster_client(address: str) -> Any:
    """A client of the Dask scheduler at an address.

    Raises InputError where the extra is missing, or where no scheduler answers.
    """
    distributed = extra("distributed", "sweep", field="--dask")
    try:
        return distributed.Client(address, timeout=CONNECT_S)
    except (OSError, ValueError, TimeoutError) as error:
        allowed = "the address of a running dask scheduler, such as tcp://127.0.0.1:8786"
        raise InputError(
            "does not answer", field="--dask", value=address, allowed=allowed
        ) from error


def _on_cluster(work: Callable[[Item], Answer], todo: list[Item], address: str) -> Iterator[Answer]:
    """Answers from a Dask cluster. What a worker that dies was at is handed to another one; see
    cluster_client.
    """
    client = cluster_client(address)
    from distributed import as_completed

    with client:
        futures = [client.submit(work, item, pure=False) for item in todo]
        try:
            for future in as_completed(futures):
                yield future.result()
                future.release()
        except BaseException:
            client.cancel(futures)
            raise


def _in_processes(
    work: Callable[[Item], Answer],
    todo: list[Item],
    jobs: int,
    interrupted: Callable[[Answer], bool],
) -> Iterator[Answer]:
    """Answers from processes of this machine. Where one of them is killed, new ones do what has no
    answer yet; BrokenProcessPool where they do not get any further either.
    """
    single_threaded()
    left = dict(enumerate(todo))
    while left:
        before = len(left)
        try:
            with closing(_pool_answers(work, dict(left), min(jobs, before))) as answers:
                for number, answer in answers:
                    if answer is None:
                        raise KeyboardInterrupt
                    del left[number]
                    yield answer
                    if interrupted(answer):
                        raise KeyboardInterrupt
        except BrokenProcessPool:
            if len(left) == before:
                raise


def _pool_answers(
    work: Callable[[Item], Answer], todo: Mapping[int, Item], jobs: int
) -> Generator[tuple[int, Answer | None]]:
    """Answers by the items' numbers, as they come; None once a Ctrl-C was heard.

    The answers of items that it ended are not looked at: what they kept is in their files.
    """
    others = active_children()
    with _heard_between_answers() as ctrl_c:
        pool = ProcessPoolExecutor(jobs, mp_context=get_context("spawn"), initializer=_begin)
        try:
            waiting = {pool.submit(_unless_stopped, work, item): n for n, item in todo.items()}
            while waiting and not ctrl_c.times:
                done, _ = wait_for_answers(waiting, LOOK_S, FIRST_COMPLETED)
                for future in done if not ctrl_c.times else ():
                    with ctrl_c.raised():
                        yield waiting.pop(future), future.result()
        finally:
            pool.shutdown(wait=False, cancel_futures=True)
            _end([process for process in active_children() if process not in others], ctrl_c)
        if ctrl_c.times:
            yield 0, None


@dataclass
class _CtrlC:
    """How often Ctrl-C was heard since this process hands out work."""

    times: int = 0
    raises: bool = False

    def heard(self, *_: object) -> None:
        """A signal's handler."""
        self.times += 1
        if self.raises:
            raise KeyboardInterrupt

    @contextmanager
    def raised(self) -> Iterator[None]:
        """While the caller is at work on an answer, Ctrl-C interrupts it where it is."""
        self.raises = True
        try:
            yield
        finally:
            self.raises = False


@contextmanager
def _heard_between_answers() -> Iterator[_CtrlC]:
    """Ctrl-C is counted, not raised: raised in the middle of a lock of the pool it would leave that
    pool without an end.

    Without effect outside the main thread and where Ctrl-C is ignored.
    """
    ctrl_c = _CtrlC()
    before = signal.getsignal(signal.SIGINT)
    here = threading.current_thread() is threading.main_thread() and before is not signal.SIG_IGN
    if here:
        signal.signal(signal.SIGINT, ctrl_c.heard)
    try:
        yield ctrl_c
    finally:
        if here:
            signal.signal(signal.SIGINT, before)


def _end(processes: list[BaseProcess], ctrl_c: _CtrlC) -> None:
    """Wait until they have ended; from a second Ctrl-C on they are killed."""
    while any(process.is_alive() for process in processes):
        for process in processes if ctrl_c.times > 1 else ():
            process.kill()
        wait([process.sentinel for process in processes if process.is_alive()], LOOK_S)


def single_threaded() -> None:
    """One thread for linear algebra in each process that has not loaded NumPy yet: processes share
    the cores.

    What the environment says already stays.
    """
    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ.setdefault(name, "1")


def _begin() -> None:
    """In a new process: Ctrl-C ends its item (unless that handles it) and all further ones; it ends
    with its parent.
    """
    signal.signal(signal.SIGINT, _stop)
    parent = parent_process()
    if parent is not None:
        threading.Thread(target=_end_with, args=(parent.sentinel,), daemon=True).start()


def _stop(*_: object) -> None:
    _stopped.set()
    if _at_work.is_set():
        raise KeyboardInterrupt


def _end_with(sentinel: int) -> None:
    wait([sentinel])
    os._exit(1)


def _unless_stopped(work: Callable[[Item], Answer], item: Item) -> Answer | None:
    if _stopped.is_set():
        return None
    try:
        _at_work.set()
        with user_code():  # here, where the traceback still tells whose file it was
            return work(item)
    except KeyboardInterrupt:
        return None
    finally:
        _at_work.clear()
