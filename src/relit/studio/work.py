"""Computations: so many at once, the others in a queue of fair turns, and none for a client that is gone.

A request that waits holds no thread. Clients take turns, and so do the sessions of each: whoever asks for
much waits behind himself.
"""

from __future__ import annotations

import asyncio
from collections import Counter, deque
from collections.abc import Callable, Coroutine, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from typing import Any, TypeVar

from relit.studio.limits import SHARE, Limits
from relit.studio.session import StudioError, busy

GoOn = Callable[[], None]
Made = TypeVar("Made")


@dataclass(eq=False)
class _Job:
    """A computation: whose it is, what it takes, and why it has been called off."""

    client: str
    session: object
    task: Callable[[GoOn], Any]
    wanted: GoOn
    memory: int
    answer: asyncio.Future[Any]
    reason: StudioError | None = None
    timer: asyncio.TimerHandle | None = field(default=None, repr=False)

    def go_on(self) -> None:
        """Raise if nobody waits for the result any more."""
        if self.reason:
            raise self.reason
        self.wanted()

    def run(self) -> Any:
        """Compute, in a thread."""
        self.go_on()
        return self.task(self.go_on)


class Work:
    """The queue of a server.

    At most `workers` computations run at once, and one more where a single client has taken all of them and
    another waits. Each session has one at a time.

    Parameters
    ----------
    limits : Limits
        Of them, `workers`, `queue`, `queue_per_session`, `working_memory` and `compute_seconds`: so long may
        a computation wait, and then run.

    Examples
    --------
    >>> async def answer():
    ...     return await Work(Limits()).do(lambda go_on: 6 * 7, session="a")
    >>> with ThreadPoolExecutor(1) as thread:  # where a loop may run already
    ...     thread.submit(lambda: asyncio.run(answer())).result()
    42
    """

    def __init__(self, limits: Limits) -> None:
        self._limits = limits
        # The models that find faces are in memory once for each thread.
        self._threads = ThreadPoolExecutor(limits.workers + 1, "relit")
        self._waiting: dict[str, dict[object, deque[_Job]]] = {}  # client → session; whose turn is next first
        self._running: list[_Job] = []

    @property
    def waiting(self) -> int:
        """How many computations wait."""
        return sum(1 for _ in self._jobs())

    @property
    def running(self) -> int:
        """How many computations run."""
        return len(self._running)

    async def do(
        self,
        task: Callable[[GoOn], Made],
        *,
        session: object,
        client: str = "",
        wanted: GoOn = lambda: None,
        memory: int = 0,
        gone: Coroutine[Any, Any, Any] | None = None,
    ) -> Made:
        """Return what a task returns, once it has had its turn.

        Parameters
        ----------
        task : callable
            Is called in a thread, with what it calls between its steps: that raises once it is called off.
        session, client
            Whose it is.
        wanted : callable
            Raises a `StudioError` once the result is not wanted any more. It is called whenever the session
            asks for something else, and between the steps.
        memory : int
            Bytes that the task takes.
        gone : coroutine, optional
            Returns once the client has hung up.

        Raises
        ------
        StudioError
            Of status 413 if the task takes more memory than there may be, of 503 if too many wait, or if the
            task takes too long; what `wanted` raises; and of 499 if the client has hung up.
        """
        loop = asyncio.get_running_loop()
        job = _Job(client, session, task, wanted, memory, loop.create_future())
        watch = asyncio.ensure_future(gone) if gone else None
        try:
            self._admit(job)
            job.timer = loop.call_later(self._limits.compute_seconds, self._call_off, job, busy())
            if watch:
                hung_up = StudioError(499, "gone", "The client has hung up.")
                watch.add_done_callback(lambda _: self._call_off(job, hung_up))
            self._start()
            return await job.answer  # type: ignore[no-any-return]
        finally:
            job.answer.cancel()  # nobody will look at it
            self._call_off(job, StudioError(499, "gone", "Nobody waits for this."))
            if watch:
                watch.cancel()

    def _jobs(self) -> Iterator[_Job]:
        """Yield what waits."""
        for sessions in self._waiting.values():
            for jobs in sessions.values():
                yield from jobs

    def _admit(self, job: _Job) -> None:
        """Let a job wait, or refuse it; where all queues are full, the longest gives way."""
        if job.memory > (most := SHARE * self._limits.working_memory):
            raise StudioError(
                413,
                "too_large",
                f"This takes about {job.memory / 1e9:.1f} GB of memory, and may take {most / 1e9:.1f}; make "
                "the photo smaller, choose another format, or have the server give its computations more.",
            )
        for other in [one for one in self._jobs() if one.session == job.session]:
            try:
                other.wanted()
            except StudioError as error:
                self._call_off(other, error)
        own = self._waiting.get(job.client, {})
        if len(own.get(job.session, ())) >= self._limits.queue_per_session:
            raise busy()
        if self.waiting >= self._limits.queue:
            counts = Counter(one.client for one in self._jobs())
            longest, most_waiting = counts.most_common(1)[0] if counts else ("", 0)
            if most_waiting <= counts[job.client] + 1:
                raise busy()
            self._call_off(list(self._waiting[longest].values())[-1][-1], busy())
        self._waiting.setdefault(job.client, {}).setdefault(job.session, deque()).append(job)

    def _call_off(self, job: _Job, reason: StudioError) -> None:
        """Answer a job at once; if it runs, it ends at its next step."""
        job.reason = job.reason or reason
        if job.timer:
            job.timer.cancel()
        self._remove(job)
        if not job.answer.done():
            job.answer.set_exception(reason)

    def _remove(self, job: _Job) -> None:
        """Let a job wait no longer."""
        sessions = self._waiting.get(job.client, {})
        if job in (jobs := sessions.get(job.session, deque())):
            jobs.remove(job)
            if not jobs:
                del sessions[job.session]
            if not sessions:
                del self._waiting[job.client]

    def _start(self) -> None:
        """Start what may run now."""
        while job := self._next():
            self._remove(job)
            # Client and session are last in turn now.
            if sessions := self._waiting.pop(job.client, None):
                self._waiting[job.client] = sessions
                if jobs := sessions.pop(job.session, None):
                    sessions[job.session] = jobs
            self._running.append(job)
            loop = job.answer.get_loop()
            if job.timer:
                job.timer.cancel()
            seconds = self._limits.compute_seconds
            too_long = StudioError(
                503, "too_long", f"This takes more than {seconds:g} s; ask for less.", seconds
            )
            job.timer = loop.call_later(seconds, self._call_off, job, too_long)
            loop.run_in_executor(self._threads, job.run).add_done_callback(
                lambda made, job=job: self._finish(job, made)  # type: ignore[misc]
            )

    def _next(self) -> _Job | None:
        """Return whose turn it is, of those that may run; what does not fit into memory is passed over."""
        sessions_at_work = [one.session for one in self._running]
        clients = Counter(one.client for one in self._running)
        taken = Counter[str]()
        for one in self._running:
            taken[one.client] += one.memory
        full = len(self._running) >= self._limits.workers
        if full and (len(clients) > 1 or len(self._running) > self._limits.workers):
            return None
        for client, sessions in self._waiting.items():
            if full and client in clients:
                continue
            for session, (job, *_) in sessions.items():
                fits = (
                    taken[client] + job.memory <= SHARE * self._limits.working_memory
                    and taken.total() + job.memory <= self._limits.working_memory
                )
                if session not in sessions_at_work and fits:
                    return job
        return None

    def _finish(self, job: _Job, made: asyncio.Future[Any]) -> None:
        """Answer a job that has run, and start the next."""
        self._running.remove(job)
        if job.timer:
            job.timer.cancel()
        error = made.exception()
        if not job.answer.done():
            if error:
                job.answer.set_exception(error)
            else:
                job.answer.set_result(made.result())
        self._start()
