"""Doing steps in order, each only if it is not up to date; a kill costs only what was under way.

The manifest is written before a step is touched, and after it is done. Where another configuration has left
something, it says `overwriting` until that is gone: what is left is never taken for the new configuration's.
"""

import logging
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from typing import Literal

from ogmkit.base.atomic import output_errors
from ogmkit.errors import OgmkitError
from ogmkit.workflow.records import Record, read_records, write_records
from ogmkit.workflow.steps import Call, Decision, Progress, Step, decide

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
    on_step: OnStep | None = None,
    on_progress: Progress | None = None,
) -> None:
    """Bring all steps up to date.

    Args:
        out: the run's folder, which nobody else writes to.
        steps: each after those that it needs.
        on_step: gets the news.
        on_progress: called with (done, in all) of the present step's own units.

    Raises:
        OgmkitError: what a step failed with, its name in front. The same call resumes there.
    """
    ledger = _Ledger(out)
    for number, step in enumerate(steps, 1):
        needed = {name: ledger.records[name].identity for name in step.needs}
        record = ledger.records.get(step.name)
        with named(step.name):
            decision = decide(step, needed, record)
            _LOG.debug("%s: %s %s", step.name, decision.action, decision.reason)
            report = StepReport(step.name, number, len(steps), "begun", decision.reason)
            if record is not None and decision.action == "skip":
                _tell(on_step, replace(report, state="skipped", detail=record.note))
                continue
            _tell(on_step, report)
            done = _do(ledger, step, decision, needed, on_progress or _ignore)
        _tell(on_step, replace(report, state="done", detail=done.note, seconds=done.seconds))


class _Ledger:
    """The manifest, on disk whenever it has changed.

    Args:
        out: the run's folder.
    """

    def __init__(self, out: Path) -> None:
        self.out = out
        self.records = read_records(out)

    def enter(self, step: Step, record: Record) -> None:
        """Write what a step has come to."""
        self.records[step.name] = record
        write_records(self.out, self.records)


def _do(ledger: _Ledger, step: Step, decision: Decision, needed: dict[str, str], advance: Progress) -> Record:
    """Do a step; the manifest says at every moment what may be made of what is there."""
    before, overwrite = ledger.records.get(step.name), decision.action == "overwrite"
    begun = Record(
        state="overwriting" if overwrite else "started",
        fingerprint=decision.fingerprint,
        settings=step.settings,
        needed=needed,
        files=() if before is None else before.files,
    )
    ledger.enter(step, begun)
    started = time.monotonic()
    let_go = partial(ledger.enter, step, replace(begun, state="started"))
    made = step.run(Call(overwrite, let_go, advance))
    with output_errors(ledger.out):
        for file in set(begun.files) - set(made.files):
            (ledger.out / file).unlink(missing_ok=True)  # such as the picture of a row that is no more
    done = replace(
        begun,
        state="done",
        identity=made.identity or begun.fingerprint,
        files=made.files,
        groups=made.groups,
        note=made.note,
        finished=datetime.now(UTC).isoformat(timespec="seconds"),
        seconds=round(time.monotonic() - started, 1),
    )
    ledger.enter(step, done)
    return done


@contextmanager
def named(step: str) -> Iterator[None]:
    """Put a step's name before what it fails with."""
    try:
        yield
    except OgmkitError as error:
        raise type(error)(f"{step}: {error}") from error


def _tell(on_step: OnStep | None, report: StepReport) -> None:
    if on_step is not None:
        on_step(report)


def _ignore(done: int, total: int) -> None:
    del done, total
