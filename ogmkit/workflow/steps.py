"""What a step is, and whether it has to be done."""

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, Protocol, runtime_checkable

from ogmkit import __version__
from ogmkit.base.differences import differences
from ogmkit.base.execution import Execution
from ogmkit.base.news import Progress
from ogmkit.homography.sources import NETWORK
from ogmkit.workflow.config import Config
from ogmkit.workflow.records import Record, fingerprint

Action = Literal["skip", "start", "resume", "overwrite"]

EXTRACT, FIT, PREDICT = "extract", "homography-fit", "predict homography"
PERCEPTION, PLANNING = "evaluate perception", "evaluate planning"
REPORT = "report"


def training(name: str) -> str:
    """The step that trains a RUN."""
    return f"train {name}"


def rendering(name: str) -> str:
    """The step that renders a set of masks."""
    return f"render-footprints {name}"


def maker_of(homography: str) -> str:
    """The step that makes a source of homographies."""
    return PREDICT if homography == NETWORK else FIT


@dataclass(frozen=True)
class Call:
    """One call of a step.

    Attributes:
        overwrite: what is there was made by another configuration, and is to be let go.
        let_go: to be called once that has happened, if then the same call without `overwrite` could resume
            where this one is cut short.
        advance: for progress.
    """

    overwrite: bool
    let_go: Callable[[], None]
    advance: Progress

    def execution(self, config: Config) -> Execution:
        """The call as the commands on whole folders take it."""
        return Execution(config.workers, config.scheduler, overwrite=self.overwrite, on_progress=self.advance)


def letting_go(call: Call) -> Progress:
    """A call's progress, of work that has let go of what was there by the time that it tells any."""
    gone = not call.overwrite

    def advance(done: int, total: int) -> None:
        nonlocal gone
        if not gone:
            call.let_go()
        gone = True
        call.advance(done, total)

    return advance


@dataclass(frozen=True)
class Made:
    """What a step has made.

    Attributes:
        files: relative to the run's folder.
        groups: added to each camera of the shards, such as `homography/surface`.
        note: the result in a few words.
        identity: of the result, of a step that is not exact.
    """

    files: tuple[str, ...] = ()
    groups: tuple[str, ...] = ()
    note: str = ""
    identity: str = ""


class Step(Protocol):
    """One step of the chain: a frozen dataclass that knows its part of the configuration."""

    @property
    def name(self) -> str:
        """As the user would call the command, such as `train footprints`."""

    @property
    def needs(self) -> tuple[str, ...]:
        """Names of the steps whose results this one reads; they stand before it."""

    @property
    def settings(self) -> Mapping[str, Any]:
        """Plain JSON values of all else that decides the result."""

    @property
    def exact(self) -> bool:
        """Whether the result follows from settings and needs: what is gone then comes back as it was."""

    def missing(self, files: Sequence[str]) -> str:
        """What isn't there of a finished step, in words; empty where all is.

        Args:
            files: what the step made.
        """

    def run(self, call: Call) -> Made:
        """Do it, or resume where an earlier call with the same settings was cut short.

        Raises:
            OgmkitError: as the library's function for it.
        """


@runtime_checkable
class SeparateStep(Step, Protocol):
    """A step whose work can run in its own process, in parallel with that of others: `run` in two parts."""

    def work(self, *, overwrite: bool) -> Callable[[Progress], Any]:
        """What is to be done, picklable; it imports nothing heavy before it is called.

        Args:
            overwrite: as of `Call`; by its first progress, what was there is gone.
        """

    def made(self, result: Any) -> Made:  # noqa: ANN401  # of `work`
        """What it has made, by what `work` gave."""


@dataclass(frozen=True)
class Decision:
    """What is to be done with a step.

    Attributes:
        action: skip it, do it for the first time, resume it, or redo it.
        reason: why, in words.
        fingerprint: of the step as it shall be; empty while something that it needs is not made.
    """

    action: Action
    reason: str
    fingerprint: str


def decide(step: Step, needed: Mapping[str, str | None], record: Record | None) -> Decision:
    """Whether a step is up to date, by what the manifest says of it.

    Args:
        step: the step.
        needed: steps that it needs → identities of what they made; None where that is still to come.
        record: the manifest's; None where the step was never begun.
    """
    known = {name: identity for name, identity in needed.items() if identity is not None}
    if len(known) < len(needed):
        waiting = next(name for name, identity in needed.items() if identity is None)
        return Decision("start" if record is None else "overwrite", f"after {waiting}", "")
    wanted = fingerprint(step.settings, known)
    if record is None:
        return Decision("start", "not done yet", wanted)
    if record.fingerprint != wanted:
        return Decision("overwrite", _change(step, known, record), wanted)
    if record.state != "done":
        return Decision("resume" if record.state == "started" else "overwrite", "was cut short", wanted)
    gone = step.missing(record.files)
    if gone:
        return Decision("resume" if step.exact else "overwrite", gone, wanted)
    return Decision("skip", "", wanted)


def plain(values: Mapping[str, Any]) -> dict[str, Any]:
    """The values as JSON has them: tuples are lists."""
    found: dict[str, Any] = json.loads(json.dumps(values))
    return found


def first_gone(out: Path, files: Sequence[str]) -> str:
    """Which file isn't there, in words; empty where all are."""
    return next((f"{file} is gone" for file in files if not (out / file).exists()), "")


def _change(step: Step, needed: Mapping[str, str], record: Record) -> str:
    """What differs from the last time, in words."""
    changes = list(differences(step.settings, record.settings))
    changes += [f"{name} has changed" for name in needed if needed[name] != record.needed.get(name)]
    changes += [f"{name} is no longer needed" for name in record.needed if name not in needed]
    if record.package_version != __version__:
        changes.append(f"made by ogmkit {record.package_version}")
    return ", ".join(changes)
