"""A report: everything that shards, trainings and tables say, in one file."""

import tempfile
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import BinaryIO

from ogmkit.base.atomic import output_errors, replacing, require_outside
from ogmkit.base.execution import Execution
from ogmkit.base.names import with_number
from ogmkit.base.news import Found, tell
from ogmkit.errors import SettingsError, TrainingError
from ogmkit.evaluation.runs import OpenRun
from ogmkit.report.html import Html
from ogmkit.report.page import write_page
from ogmkit.report.predictions import NONE, Predictions, predict_examples
from ogmkit.report.scores import read_scores
from ogmkit.report.section_scores import scores_section
from ogmkit.report.section_trainings import trainings_section
from ogmkit.report.sections import Section
from ogmkit.report.settings import ReportSettings
from ogmkit.report.shards import Keep, ShardFolder, Shown, read_shards
from ogmkit.report.soundness import examined
from ogmkit.report.sources import Sources
from ogmkit.report.trainings import read_trainings
from ogmkit.shards.manifest import read_manifest

Progress = Callable[[int, int], None]
DEFAULT = ReportSettings()


@dataclass(frozen=True)
class Means:
    """How a report is made.

    Attributes:
        runs: opened, that predict grids; each predicts examples.
        dataroot: the dataset; None for the place that the shards name.
        workers: worker processes that read shards.
        on_progress: called with (steps done, steps in all).
    """

    runs: Sequence[OpenRun] = ()
    dataroot: Path | None = None
    workers: int = 0
    on_progress: Progress | None = None


def write_report(
    out: Path, sources: Sources, settings: ReportSettings = DEFAULT, means: Means | None = None
) -> None:
    """Write a report; what was there is replaced.

    Args:
        out: the HTML file.
        sources: what it is of.
        settings: what it shows.
        means: how it is made.

    Raises:
        OutputError: the file can't be written, or lies among the shards.
        ShardError, DataFileError, TableError, CheckpointError: what is to be shown is absent or damaged.
    """
    if sources.shards is not None:
        require_outside(out, sources.shards)
    with _spool(out) as spool:

        def keep(pictures: bytes) -> None:
            with output_errors(out):
                spool.write(pictures)

        shown = _shown(sources, settings, means or Means(), keep)
        sections = _ordered((*(shown.sections if shown else ()), *_of_runs(sources)))
        title = shown.title if shown else "Trainings" if sources.runs else "Tables"
        with replacing(out) as part, part.open("wb") as file:
            spool.seek(0)
            write_page(
                file, title, _subtitle(sources), sections, shown.frames.html() if shown else Html(""), spool
            )


@contextmanager
def _spool(out: Path) -> Iterator[BinaryIO]:
    """A file without a name beside `out`, which ends with the process."""
    with output_errors(out):
        spool = tempfile.TemporaryFile(dir=out.parent)  # noqa: SIM115  # closed below
    with spool:
        yield spool


def _shown(sources: Sources, settings: ReportSettings, means: Means, keep: Keep) -> Shown | None:
    """What is shown of shards; None without."""
    if sources.shards is None:
        return None
    manifest = read_manifest(sources.shards)
    tell(Found(f"{with_number(len(manifest.shards), 'scene')}; {Execution(means.workers).place}"))
    count = len(manifest.shards)
    steps = _Steps(
        means.on_progress, count * (1 if settings.no_verify else 2) + len(means.runs) * settings.examples
    )
    verifying = Execution(means.workers, on_progress=steps.stage(0 if settings.no_verify else count))
    soundness = examined(sources.shards, manifest, means.dataroot, settings, verifying)
    predictions = _predictions(sources.shards, settings, means, steps)
    folder = ShardFolder(sources.shards, manifest, means.dataroot, soundness, predictions)
    return read_shards(folder, settings, Execution(means.workers, on_progress=steps.stage(count)), keep)


def _predictions(shards: Path, settings: ReportSettings, means: Means, steps: "_Steps") -> Predictions:
    """Examples; none, with a word why, where the runs are not of these shards."""
    advance = steps.stage(len(means.runs) * settings.examples)
    try:
        return predict_examples(shards, means.runs, settings.examples, on_progress=advance)
    except (SettingsError, TrainingError) as error:
        tell(Found(f"no examples of predictions: {error}"))
        return NONE


@dataclass
class _Steps:
    """Progress over several stages, as one count."""

    on_progress: Progress | None
    total: int
    begun: int = field(default=0)

    def stage(self, count: int) -> Progress:
        """The next stage, of so many steps."""
        first = self.begun
        self.begun += count

        def advance(done: int, total: int) -> None:
            del total
            if self.on_progress is not None:
                self.on_progress(first + done, self.total)

        return advance


_LAST = ("scenes",)
_FIRST = ("extracted", "sound", "perception", "planning", "trainings")


def _of_runs(sources: Sources) -> Iterator[Section]:
    """Of trainings and tables."""
    counts = Counter[str]()
    for path in sources.tables:
        tables = read_scores(path)
        title = "Planning" if any(one.plans for one in tables) else "Perception"
        counts[title] += 1
        name = title.lower() + (f"-{counts[title]}" if counts[title] > 1 else "")
        yield scores_section(name, title, path.name, tables)
    if sources.runs:
        yield trainings_section(read_trainings(sources.runs))


def _ordered(sections: Sequence[Section]) -> tuple[Section, ...]:
    """What was found stands before what it was found on; the longest table last."""
    return tuple(sorted(sections, key=lambda one: _place(one.identity)))


def _place(identity: str) -> int:
    kind = identity.partition("-")[0]
    if kind in _FIRST:
        return _FIRST.index(kind)
    return len(_FIRST) + (identity in _LAST)


def _subtitle(sources: Sources) -> str:
    counts = {"training": len(sources.runs), "table": len(sources.tables)}
    shards = [] if sources.shards is None else [str(sources.shards.resolve())]
    return " · ".join([*shards, *(with_number(count, what) for what, count in counts.items() if count)])
