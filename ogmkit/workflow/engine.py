"""Doing steps, each only if it is not up to date; a kill costs only what was under way.

The manifest is written before a step is touched, and after it is done. Where another configuration has left
something, it says `overwriting` until that is gone: what is left is never taken for the new configuration's.
"""

import logging
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from functools import partial
from itertools import groupby
from pathlib import Path
from typing import Literal, cast

from ogmkit.base.atomic import output_errors
from ogmkit.base.news import Progress
from ogmkit.base.side_by_side import SideBySide
from ogmkit.errors import OgmkitError
from ogmkit.workflow.records import Record, read_records, write_records
from ogmkit.workflow.steps import Call, Decision, Made, SeparateStep, Step, decide, letting_go

_LOG = logging.getLogger(__name__)


@dataclass(frozen=True)
class StepReport:
    """News of a step.

    Attributes:
        name: the step's.
        number: its place, from 1.
        total: steps in all.
        state: up to date; its work begins; it is done.
        detail: why it is done; of a finished one, the result in a few words.
        seconds: wall time, where it is done.
    """

    name: str
    number: int
    total: int
    state: Literal["skipped", "begun", "done"]
    detail: str
    seconds: float = 0.0


OnStep = Callable[[StepReport], None]


def plan_steps(out: Path, steps: Sequence[Step]) -> tuple[Decision, ...]:
    """What `run_steps` would do, one decision a step; writes nothing.

    Raises:
        ShardError, OutputError: the manifest is damaged or foreign, or shards are.
    """
    records, decisions = read_records(out), []
    identities: dict[str, str | None] = {}
    for step in steps:
        record = records.get(step.name)
        with named(step.name):
            decision = decide(step, {name: identities[name] for name in step.needs}, record)
        decisions.append(decision)
        made = record.identity if record is not None and decision.action == "skip" else None
        identities[step.name] = (decision.fingerprint or None) if step.exact else made
    return tuple(decisions)


def run_steps(
    out: Path,
    steps: Sequence[Step],
    *,
    places: Sequence[Mapping[str, str]] = (),
    on_step: OnStep | None = None,
    on_progress: Progress | None = None,
) -> None:
    """Bring all steps up to date.

    Args:
        out: the run's folder, which nobody else writes to.
        steps: each after those that it needs.
        places: environment variables of processes. Where there are several, steps that can be done separately
            are done side by side, in so many processes, as far as they don't need each other.
        on_step: gets the news.
        on_progress: called with (done, in all) of the present step's own units, or of all present steps'.

    Raises:
        OgmkitError: what a step failed with, its name in front. The same call resumes there.
        KeyboardInterrupt: Ctrl-C, and where several processes work, SIGTERM.
    """
    run = _Run(out, len(steps), on_step or _unheard, on_progress or _ignore)
    numbered = enumerate(steps, 1)
    if len(places) <= 1:
        run.in_order(numbered)
        return
    for separate, group in groupby(numbered, lambda one: isinstance(one[1], SeparateStep)):
        together = [*group]
        if separate and len(together) > 1:
            run.side_by_side(together, places)
        else:
            run.in_order(together)  # one alone has the whole machine


@dataclass(frozen=True)
class _Begun:
    """A step under way.

    Attributes:
        step: which.
        report: its news.
        record: as it stands in the manifest.
        started_s: on the monotonic clock.
    """

    step: Step
    report: StepReport
    record: Record
    started_s: float


class _Run:
    """Steps being done, and the manifest, on disk whenever it has changed.

    Args:
        out: the run's folder.
        total: steps in all.
        on_step: gets the news.
        on_progress: gets the counts.
    """

    def __init__(self, out: Path, total: int, on_step: OnStep, on_progress: Progress) -> None:
        self._out = out
        self._total = total
        self._on_step = on_step
        self._on_progress = on_progress
        self._records = read_records(out)

    def in_order(self, steps: Iterable[tuple[int, Step]]) -> None:
        """Do steps in this process."""
        for number, step in steps:
            with named(step.name):
                begun = self._begin(number, step)
                if begun is not None:
                    self._end(begun, step.run(self._call(begun, self._on_progress)))

    def side_by_side(self, steps: Iterable[tuple[int, Step]], places: Sequence[Mapping[str, str]]) -> None:
        """Do separate steps in processes, at most one a place."""
        free = [*places]
        under_way: dict[str, tuple[_Begun, Mapping[str, str]]] = {}
        counts: dict[str, tuple[int, int]] = {}

        def advance(name: str, done: int, total: int) -> None:
            counts[name] = (done, total)
            self._on_progress(*map(sum, zip(*counts.values(), strict=True)))

        def end_some() -> None:
            for name, result in calls.ended().items():
                begun, place = under_way.pop(name)
                counts.pop(name, None)
                free.append(place)
                with named(name):
                    self._end(begun, cast("SeparateStep", begun.step).made(result))

        with SideBySide() as calls:
            for number, step in steps:
                while not free or {*step.needs} & {*calls.names}:
                    end_some()
                with named(step.name):
                    begun = self._begin(number, step)
                    if begun is not None:
                        place = free.pop(0)
                        under_way[step.name] = begun, place
                        call = self._call(begun, partial(advance, step.name))
                        work = cast("SeparateStep", step).work(overwrite=call.overwrite)
                        calls.begin(step.name, work, place, letting_go(call))
            while calls.names:
                end_some()

    def _begin(self, number: int, step: Step) -> _Begun | None:
        """Tell the manifest what may be made of what is there; None for a step that is up to date."""
        needed = {name: self._records[name].identity for name in step.needs}
        before = self._records.get(step.name)
        decision = decide(step, needed, before)
        _LOG.debug("%s: %s %s", step.name, decision.action, decision.reason)
        report = StepReport(step.name, number, self._total, "begun", decision.reason)
        if before is not None and decision.action == "skip":
            self._on_step(replace(report, state="skipped", detail=before.note))
            return None
        self._on_step(report)
        record = Record(
            state="overwriting" if decision.action == "overwrite" else "started",
            fingerprint=decision.fingerprint,
            settings=step.settings,
            needed=needed,
            files=() if before is None else before.files,
        )
        self._enter(step, record)
        return _Begun(step, report, record, time.monotonic())

    def _call(self, begun: _Begun, on_progress: Progress) -> Call:
        let_go = partial(self._enter, begun.step, replace(begun.record, state="started"))
        return Call(begun.record.state == "overwriting", let_go, on_progress)

    def _end(self, begun: _Begun, made: Made) -> None:
        """Remove files that are no longer made, and record in the manifest what there is."""
        with output_errors(self._out):
            for file in set(begun.record.files) - set(made.files):
                (self._out / file).unlink(missing_ok=True)  # such as the picture of a row that was dropped
        done = replace(
            begun.record,
            state="done",
            identity=made.identity or begun.record.fingerprint,
            files=made.files,
            groups=made.groups,
            note=made.note,
            finished=datetime.now(UTC).isoformat(timespec="seconds"),
            seconds=round(time.monotonic() - begun.started_s, 1),
        )
        self._enter(begun.step, done)
        self._on_step(replace(begun.report, state="done", detail=done.note, seconds=done.seconds))

    def _enter(self, step: Step, record: Record) -> None:
        """Write what a step has come to."""
        self._records[step.name] = record
        write_records(self._out, self._records)


@contextmanager
def named(step: str) -> Iterator[None]:
    """Put a step's name before what it fails with."""
    try:
        yield
    except OgmkitError as error:
        raise type(error)(f"{step}: {error}") from error


def _unheard(report: StepReport) -> None:
    del report


def _ignore(done: int, total: int) -> None:
    del done, total
