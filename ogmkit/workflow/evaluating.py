"""Steps that score what was trained: tables in several formats, and pictures."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any, ClassVar, TypeVar

from ogmkit.base.atomic import output_errors, replacing
from ogmkit.base.parts import remove_parts
from ogmkit.evaluation import formats
from ogmkit.evaluation.evaluate import evaluate
from ogmkit.evaluation.planning.evaluate import evaluate_plans
from ogmkit.evaluation.planning.result import PlanEvaluation
from ogmkit.evaluation.result import Evaluation
from ogmkit.evaluation.runs import OpenRun
from ogmkit.pictures.evaluation_sheet import draw_evaluation
from ogmkit.pictures.planning_sheet import draw_plans
from ogmkit.workflow import steps
from ogmkit.workflow.config import Config, Training
from ogmkit.workflow.steps import Call, Made, first_gone

Write = Callable[[Evaluation | PlanEvaluation], str]
_Evaluated = TypeVar("_Evaluated", bound=Evaluation | PlanEvaluation)
Draw = Callable[[Path, _Evaluated, Path], tuple[Path, ...]]

WRITERS: Mapping[str, Write] = {
    "md": formats.as_markdown,
    "csv": formats.as_csv,
    "json": formats.as_json,
    "tex": formats.as_latex,
}
"""Ending of a table's file → what writes it."""


@dataclass(frozen=True)
class _Evaluate:
    """What both tables share: how they are written and drawn, and when they are there.

    Attributes:
        config: the whole configuration.
        writers: ending of a table's file → what writes it.
    """

    config: Config
    writers: Mapping[str, Write]

    name: ClassVar[str]

    @property
    def exact(self) -> bool:
        """The table follows from shards and networks."""
        return True

    def missing(self, files: Sequence[str]) -> str:
        """A table or picture."""
        return first_gone(self.config.out, (*_tables(self.name, self.writers), *files))

    def _opened(self, trainings: Sequence[Training]) -> list[OpenRun]:
        """What the trainings gave."""
        from ogmkit.learn.predict.run import open_run  # noqa: PLC0415  # torch

        return [open_run(self.config.run_folder(one.name)) for one in trainings]

    def _kept(self, evaluation: _Evaluated, draw: Draw[_Evaluated], scored: str) -> Made:
        """Write the table, and draw where the configuration asks for it."""
        out = self.config.out
        files = _written(out, self.name, evaluation, self.writers)
        pictures = _made(out / "pictures" / _topic(self.name))
        drawn = draw(self.config.shards, evaluation, pictures) if self.config.evaluate.samples else ()
        return Made((*files, *_relative(out, drawn)), note=scored)


class EvaluatePerception(_Evaluate):
    """The first table: occupancy grids."""

    name = steps.PERCEPTION

    @property
    def needs(self) -> tuple[str, ...]:
        """Shards, their homographies, the networks, and the masks that they are compared with."""
        grids = self.config.grids
        sets = (one.settings.masks_learnt for one in grids)
        return (
            steps.EXTRACT,
            *dict.fromkeys(steps.maker_of(source) for source in self.config.homographies),
            *dict.fromkeys(steps.rendering(name) for name in sets if name is not None),
            *(steps.training(one.name) for one in grids),
        )

    @property
    def settings(self) -> Mapping[str, Any]:
        """What is scored, and how."""
        runs = [one.name for one in self.config.grids]
        return {"runs": runs, "ceilings": self._ceilings, **asdict(self.config.evaluate)}

    @property
    def _ceilings(self) -> list[str]:
        """The homographies asked for: shards may hold those of earlier configurations, too."""
        return sorted(self.config.homographies)

    def run(self, call: Call) -> Made:
        """Score, write and draw."""
        config = self.config
        evaluation = evaluate(
            config.shards,
            self._opened(config.grids),
            config.evaluate,
            ceilings=self._ceilings,
            workers=config.readers,
            on_progress=call.advance,
        )
        return self._kept(evaluation, draw_evaluation, f"{evaluation.frames} frames")


class EvaluatePlanning(_Evaluate):
    """The second table: plans."""

    name = steps.PLANNING

    @property
    def needs(self) -> tuple[str, ...]:
        """Shards, the homographies that planners warp by, and the planners."""
        planners = self.config.planners
        sources = [source for one in planners for source in one.settings.homographies_read.values()]
        return (
            steps.EXTRACT,
            *dict.fromkeys(map(steps.maker_of, sources)),
            *(steps.training(one.name) for one in planners),
        )

    @property
    def settings(self) -> Mapping[str, Any]:
        """What is scored, and how."""
        settings = asdict(self.config.evaluate)
        kept = ("split", "batch_size", "limit", "samples")
        return {"runs": [one.name for one in self.config.planners], **{name: settings[name] for name in kept}}

    def run(self, call: Call) -> Made:
        """Score, write and draw; masks are warped by what each planner was trained with."""
        config = self.config
        evaluation = evaluate_plans(
            config.shards,
            self._opened(config.planners),
            replace(config.evaluate, homography=None),
            workers=config.readers,
            on_progress=call.advance,
        )
        return self._kept(evaluation, draw_plans, f"{evaluation.sequences} sequences")


def _topic(name: str) -> str:
    """What a step's files are called."""
    return name.removeprefix("evaluate ")


def _tables(name: str, writers: Mapping[str, Write]) -> tuple[str, ...]:
    """The files of a step's table."""
    return tuple(f"tables/{_topic(name)}.{ending}" for ending in writers)


def _written(
    out: Path, name: str, evaluation: Evaluation | PlanEvaluation, writers: Mapping[str, Write]
) -> tuple[str, ...]:
    """Write the table in all formats."""
    files = _tables(name, writers)
    _made(out / "tables")
    for file, write in zip(files, writers.values(), strict=True):
        with replacing(out / file) as part:
            part.write_text(write(evaluation), encoding="utf-8")
    return files


def _made(folder: Path) -> Path:
    """A folder for results, rid of what a killed call was writing."""
    with output_errors(folder):
        folder.mkdir(parents=True, exist_ok=True)
        remove_parts(folder)
    return folder


def _relative(out: Path, paths: Sequence[Path]) -> tuple[str, ...]:
    return tuple(path.relative_to(out).as_posix() for path in paths)
