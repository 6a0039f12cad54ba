"""Running long calls in parallel, each in its own process, with progress and news as they come."""

import os
import signal
import threading
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from multiprocessing import get_context
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess
from types import TracebackType
from typing import Any, Self

from ogmkit.base.interrupts import interrupts_blocked, sigterm_interrupts
from ogmkit.base.news import (
    Found,
    News,
    Passed,
    Progress,
    Quitting,
    State,
    Stopping,
    Waiting,
    listening,
    tell,
)
from ogmkit.base.processes import end_with
from ogmkit.base.units import Answer, answered, log_level
from ogmkit.errors import OgmkitError


@dataclass(frozen=True)
class _Advance:
    done: int
    total: int


@dataclass(frozen=True)
class _Call:
    process: BaseProcess
    pipe: Connection
    on_progress: Progress


class SideBySide:
    """A context of calls by name; whatever ends it, they end with it.

    On an exception they are asked to keep what they have (SIGTERM), and waited for; Ctrl-C while they are
    ends them at once. They never see Ctrl-C themselves. Inside, SIGTERM does as Ctrl-C here.
    """

    def __init__(self) -> None:
        self._calls: dict[str, _Call] = {}
        self._signals = sigterm_interrupts()

    @property
    def names(self) -> tuple[str, ...]:
        """Of the calls that are under way."""
        return tuple(self._calls)

    def begin(
        self,
        name: str,
        work: Callable[[Progress], object],
        environment: Mapping[str, str],
        on_progress: Progress,
    ) -> None:
        """Begin a call.

        Args:
            name: its own among those that are under way; where there are several, its news begin with it.
            work: what to do, picklable; called with a callback for progress.
            environment: variables of its process, set before `work` is called.
            on_progress: called in this process, by `ended`.
        """
        context = get_context("spawn")  # neither torch's threads nor CUDA survive a fork
        ours, theirs = context.Pipe()
        process = context.Process(
            target=_work, args=(theirs, dict(environment), work, log_level()), name=name
        )
        with interrupts_blocked():
            process.start()
            self._calls[name] = _Call(process, ours, on_progress)
        theirs.close()

    def ended(self) -> dict[str, Any]:
        """Wait until something comes from a call that is under way; results of those that it ends.

        Raises:
            OgmkitError: what a call raised, or its process has ended without a result; the name in front.
        """
        results: dict[str, Any] = {}
        for name, call in self._ready():
            try:
                came = _received(call)
                if isinstance(came, Answer):
                    call.process.join()
                    del self._calls[name]
                    results[name] = came.unpacked()
            except OgmkitError as error:
                raise type(error)(f"{name}: {error}") from error
            if isinstance(came, _Advance):
                call.on_progress(came.done, came.total)
            elif isinstance(came, Found | Waiting | State | Passed):  # of Ctrl-C, this process tells
                tell(came if len(self._calls) == 1 else replace(came, text=f"{name}: {came.text}"))
        return results

    def __enter__(self) -> Self:
        self._signals.__enter__()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        try:
            if self._calls:
                self._stop(told=isinstance(error, KeyboardInterrupt))
        except KeyboardInterrupt:
            tell(Quitting())
            raise
        finally:
            for call in self._calls.values():
                call.process.kill()
                call.process.join()
            self._signals.__exit__(kind, error, trace)

    def _stop(self, *, told: bool) -> None:
        """Let the calls keep what they have; what they still send is dropped."""
        if told:
            tell(Stopping("step"))
        for call in self._calls.values():
            call.process.terminate()
        while self._calls:
            for name, call in self._ready():
                try:
                    _received(call)
                except OgmkitError:  # it has ended
                    del self._calls[name]

    def _ready(self) -> list[tuple[str, _Call]]:
        pipes = wait([call.pipe for call in self._calls.values()])
        return [(name, call) for name, call in self._calls.items() if call.pipe in pipes]


def _received(call: _Call) -> object:
    """What comes through a call's pipe."""
    try:
        return call.pipe.recv()
    except (EOFError, OSError):
        call.process.join()
        raise OgmkitError(
            f"its process ended with code {call.process.exitcode}, perhaps for lack of memory; "
            "run the same command to resume"
        ) from None


def _work(
    pipe: Connection, environment: Mapping[str, str], work: Callable[[Progress], object], level: int
) -> None:
    """Do the work in the new process."""
    os.environ.update(environment)
    end_with(pipe)
    sending = threading.Lock()

    def send(what: object) -> None:
        with sending:
            pipe.send(what)

    def advance(done: int, total: int) -> None:
        send(_Advance(done, total))

    def hear(news: News) -> None:
        send(news)

    with listening(hear):
        try:
            send(answered(work, advance, level))
        except KeyboardInterrupt:
            os._exit(128 + signal.SIGINT)  # it was asked to stop, and has kept what it had
