"""The figures of a training's log, metrics.csv."""

import csv
import io
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from ogmkit.base.atomic import output_errors, replacing
from ogmkit.base.files import read_text
from ogmkit.errors import MALFORMED, CheckpointError

_HEADER = ["epoch", "step", "name", "value"]
_REMEDY = "remove it: the figures so far are lost, the training is not"


@dataclass(frozen=True)
class Figure:
    """A figure of a training's log.

    Attributes:
        epoch: in which it was written, from 0.
        step: optimiser steps before it.
        name: such as `train/loss` or `val/iou`.
        value: the figure.
    """

    epoch: int
    step: int
    name: str
    value: float


def read_figures(path: Path) -> tuple[Figure, ...]:
    """The figures of a log, in order; none where it is absent.

    A last line without its end is what a killed training was writing, and is left out.

    Raises:
        CheckpointError: the file can't be read, or holds something else.
    """
    try:
        lines = io.StringIO(read_text(path), newline="")
        rows = csv.DictReader(line for line in lines if line.endswith("\n"))
        if rows.fieldnames != _HEADER:
            raise ValueError(f"its first line isn't {','.join(_HEADER)}")
        return tuple(
            Figure(int(row["epoch"]), int(row["step"]), row["name"], float(row["value"])) for row in rows
        )
    except FileNotFoundError:
        return ()
    except OSError as error:
        raise CheckpointError(f"{path}: can't be read ({error.strerror}); {_REMEDY}") from error
    except (*MALFORMED, csv.Error) as error:
        raise CheckpointError(f"{path}: is damaged ({error}); {_REMEDY}") from error


def write_figures(path: Path, figures: Iterable[Figure]) -> None:
    """Rewrite a log, completely or not at all.

    Raises:
        OutputError: the system refuses to write.
    """
    with replacing(path) as part, part.open("w", newline="", encoding="utf-8") as file:
        csv.writer(file).writerows([_HEADER, *map(_row, figures)])


def append_figures(path: Path, figures: Iterable[Figure]) -> None:
    """Append to a log.

    Raises:
        OutputError: the system refuses to write.
    """
    with output_errors(path), path.open("a", newline="", encoding="utf-8") as file:
        csv.writer(file).writerows(map(_row, figures))


def _row(figure: Figure) -> tuple[object, ...]:
    return figure.epoch, figure.step, figure.name, f"{figure.value:.6g}"
