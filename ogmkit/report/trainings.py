"""What the folders of trainings say: settings, and figures over the epochs."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ogmkit.evaluation.entrants import names_of
from ogmkit.learn.figures import Figure, read_figures
from ogmkit.learn.run_summary import summarise_run
from ogmkit.learn.runs import METRICS

Points = tuple[tuple[int, float], ...]
"""(step, value) in order."""


@dataclass(frozen=True)
class Training:
    """One RUN.

    Attributes:
        name: that tells it from the others.
        system: what was trained.
        settings: all of them, as plain values.
        scenes: split → how many.
        checkpoints: names of the files that are there, best first.
        curves: figure → its points.
    """

    name: str
    system: str
    settings: Mapping[str, Any]
    scenes: Mapping[str, int]
    checkpoints: tuple[str, ...]
    curves: Mapping[str, Points]


def read_trainings(runs: Sequence[Path]) -> tuple[Training, ...]:
    """Read the RUNs' settings and logs; no checkpoint is read.

    Raises:
        CheckpointError: settings or figures are damaged.
        TableError: splits are damaged.
    """
    summaries = [summarise_run(run) for run in runs]
    names = names_of(runs, [run.name for run in runs], ())
    return tuple(
        Training(
            name=name,
            system=one.system,
            settings=one.settings,
            scenes={split: len(scenes) for split, scenes in one.scenes.items()},
            checkpoints=one.checkpoints,
            curves=curves_of(read_figures(run / METRICS)),
        )
        for name, one, run in zip(names, summaries, runs, strict=True)
    )


def curves_of(figures: Sequence[Figure]) -> dict[str, Points]:
    """Figure's name → (step, value), names and points in the log's order."""
    found: dict[str, list[tuple[int, float]]] = {}
    for one in figures:
        found.setdefault(one.name, []).append((one.step, one.value))
    return {name: tuple(points) for name, points in found.items()}


def differing(trainings: Sequence[Training]) -> dict[str, tuple[str, ...]]:
    """Setting → its value in each training, of those that are not the same in all."""
    names = dict.fromkeys(name for one in trainings for name in one.settings)
    shown = {name: tuple(_shown(one.settings.get(name, _ABSENT)) for one in trainings) for name in names}
    return {name: values for name, values in shown.items() if len(set(values)) > 1}


_ABSENT = object()


def _shown(value: object) -> str:
    if value is _ABSENT:
        return ""
    return " × ".join(map(str, value)) if isinstance(value, list | tuple) else str(value)
