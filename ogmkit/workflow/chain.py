"""The whole chain as one run: shards, homographies, masks, networks, tables, a report, what made what."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from ogmkit.base.atomic import output_errors, replacing
from ogmkit.base.news import Progress
from ogmkit.base.parts import is_part
from ogmkit.errors import OutputError
from ogmkit.pipeline.output import check_place, locked
from ogmkit.shards.manifest import LOCK
from ogmkit.workflow.addition import FitHomographies, PredictHomographies, RenderMasks
from ogmkit.workflow.config import Config
from ogmkit.workflow.engine import OnStep, plan_steps, run_steps
from ogmkit.workflow.evaluating import WRITERS, EvaluatePerception, EvaluatePlanning, Write
from ogmkit.workflow.extraction import Extract
from ogmkit.workflow.needs import require_needs
from ogmkit.workflow.records import NAME, read_records
from ogmkit.workflow.reporting import FILE, WriteReport
from ogmkit.workflow.steps import Action, Step
from ogmkit.workflow.training import Train

CONFIG = "config.yaml"
_OURS = {"shards", "runs", "tables", "pictures", FILE, CONFIG, NAME, LOCK}


@dataclass(frozen=True)
class PlannedStep:
    """What a run would do with a step.

    Attributes:
        name: the step's.
        action: skip it, do it for the first time, resume it, or redo it.
        reason: why, in words; empty for one that is skipped.
    """

    name: str
    action: Action
    reason: str


@dataclass(frozen=True)
class ChainSummary:
    """What is there after a run.

    Attributes:
        tables: files of the tables, sorted.
        pictures: files of pictures, sorted.
        report: the page that shows all of it.
        left: RUNs that the configuration knows no more; they are left as they are, and not evaluated.
    """

    tables: tuple[Path, ...]
    pictures: tuple[Path, ...]
    report: Path
    left: tuple[Path, ...]


def steps_of(config: Config, writers: Mapping[str, Write] | None = None) -> tuple[Step, ...]:
    """The steps that a configuration asks for, each after those that it needs.

    Args:
        config: the configuration.
        writers: more formats of tables: ending → what writes an evaluation.

    Raises:
        TableError, SettingsError: there is no such dataset, or it has no such version or split file.
    """
    made = tuple(_steps(config, {**WRITERS, **(writers or {})}))
    return (*made, WriteReport(config, tuple(step.name for step in made)))


def plan_chain(config: Config, writers: Mapping[str, Write] | None = None) -> tuple[PlannedStep, ...]:
    """What `run_chain` would do; writes nothing.

    Raises:
        OgmkitError: as `run_chain`, as far as that shows before anything is done.
    """
    _require_ours(config)
    require_needs(config)
    steps = steps_of(config, writers)
    return tuple(
        PlannedStep(step.name, decision.action, decision.reason)
        for step, decision in zip(steps, plan_steps(config.out, steps), strict=True)
    )


def run_chain(
    config: Config,
    *,
    writers: Mapping[str, Write] | None = None,
    on_step: OnStep | None = None,
    on_progress: Progress | None = None,
) -> ChainSummary:
    """Make everything that a configuration asks for, as far as it isn't there.

    Killed at any moment, the same call again resumes; it ends with the tables of a run that nothing
    disturbed. With another configuration, what depends on a change is redone, and nothing else.

    Args:
        config: what to make.
        writers: more formats of tables: ending → what writes an evaluation.
        on_step: gets news of steps.
        on_progress: called with (done, in all) of the present step's own units.

    Raises:
        OutputError: the folder is foreign or can't be written, or another run holds it.
        OgmkitError: what a step failed with, or needs and will not get; its name in front.
        KeyboardInterrupt: Ctrl-C, once a training has saved its state.
    """
    _require_ours(config)
    require_needs(config)
    steps = steps_of(config, writers)
    with locked(config.out):
        _write_config(config)
        places = _places(config.trainings_at_once)
        run_steps(config.out, steps, places=places, on_step=on_step, on_progress=on_progress)
        names = {step.name for step in steps}
        made = sorted(
            config.out / file
            for name, record in read_records(config.out).items()
            if name in names
            for file in record.files
        )
    return ChainSummary(
        tables=tuple(path for path in made if path.is_relative_to(config.out / "tables")),
        pictures=tuple(path for path in made if path.is_relative_to(config.out / "pictures")),
        report=config.out / FILE,
        left=left_runs(config),
    )


def left_runs(config: Config) -> tuple[Path, ...]:
    """Folders of trainings that the configuration knows no more."""
    runs = config.out / "runs"
    known = {training.name for training in config.trainings}
    if not runs.is_dir():
        return ()
    return tuple(sorted(path for path in runs.iterdir() if path.is_dir() and path.name not in known))


def _steps(config: Config, writers: Mapping[str, Write]) -> Iterator[Step]:
    yield Extract.of(config)
    yield FitHomographies(config)
    if config.homography is not None:
        yield Train(config, config.homography)
        yield PredictHomographies(config, config.homography)
    for name in _sets(config):
        yield RenderMasks(config, config.footprint_set(name))
    for training in (*config.grids, *config.planners):
        yield Train(config, training)
    if config.grids:
        yield EvaluatePerception(config, writers)
    if config.planners:
        yield EvaluatePlanning(config, writers)


def _places(count: int) -> tuple[Mapping[str, str], ...]:
    """Variables of the processes of trainings that go on side by side; none where they follow each other."""
    if count <= 1:
        return ()
    from ogmkit.learn.devices import shares  # noqa: PLC0415  # torch

    return shares(count)


def _sets(config: Config) -> tuple[str, ...]:
    """Sets of masks: those that are asked for, and those that something learns."""
    learners = (*config.grids, *config.planners)
    learnt = [one.settings.masks_learnt for one in learners if one.settings.masks_learnt is not None]
    return tuple(dict.fromkeys((*config.masks.sets, *learnt)))


def _require_ours(config: Config) -> None:
    """Refuse a folder that holds something else, before anything is written there.

    Raises:
        OutputError: it does, or it lies in the dataset.
        ShardError: the manifest of an earlier run is damaged.
    """
    out = config.out
    check_place(out, config.source.data)
    read_records(out)
    if not out.exists() or (out / NAME).exists():
        return
    with output_errors(out):
        foreign = sorted(path.name for path in out.iterdir() if path.name not in _OURS and not is_part(path))
    if foreign:
        raise OutputError(f"{out}: holds {foreign[0]}, and no `ogmkit run` made it; choose another `out`")


def _write_config(config: Config) -> None:
    """Keep the configuration as it was understood, as a file that says the same again."""
    from ogmkit.learn.yaml_files import as_yaml  # noqa: PLC0415  # YAML comes with the extra `train`

    with replacing(config.out / CONFIG) as part:
        text = as_yaml(config)
        part.write_text(text, encoding="utf-8")
