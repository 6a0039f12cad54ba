"""What `ogmkit evaluate` writes to stdout, and its table of other networks' grids."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from .progress import progress

if TYPE_CHECKING:
    from ogmkit.evaluation.formats import Tabled
    from ogmkit.evaluation.settings import EvaluateSettings

ROWS = ("csv", "json")
"""Formats that hold a row a figure: of one stage only, since the two have other keys."""


def label_table(
    shards: Path,
    runs: tuple[Path, ...],
    definition: str,
    predictions: tuple[Path, ...],
    chosen: tuple[EvaluateSettings, Path | None, tuple[str, ...]],
    form: str,
) -> None:
    """Write the table of other networks' grids to stdout."""
    from ogmkit.evaluation.label_scores import require_one_table, score_predictions

    require_one_table(shards, definition, runs)
    if not predictions:
        raise click.UsageError(f"--definition {definition} needs --predictions.")
    settings, split_file, cameras = chosen
    with progress(None, "scenes", "evaluate") as advance:
        evaluation = score_predictions(
            shards,
            definition,
            predictions,
            split=settings.split,
            split_file=split_file,
            camera=cameras[0] if cameras else "CAM_FRONT",
            threshold=settings.threshold,
            on_progress=advance,
        )
    click.echo(written(evaluation, form, all_tables=True), nl=False)


def written(evaluation: Tabled, form: str, all_tables: bool) -> str:
    """The evaluation in a format."""
    from ogmkit.evaluation import formats

    if form in ROWS:
        return {"csv": formats.as_csv, "json": formats.as_json}[form](evaluation)
    if form == "text":
        from .evaluate_text import report_text

        return report_text(formats.report_of(evaluation, all_tables))
    writers = {"markdown": formats.as_markdown, "latex": formats.as_latex}
    return writers[form](evaluation, all_tables)
