"""The runs whose predictions a report shows: those that predict grids, opened where torch is installed."""

import importlib.util
from collections.abc import Sequence
from pathlib import Path

from ogmkit.base.news import Found, tell
from ogmkit.evaluation.runs import OpenRun
from ogmkit.learn.catalogue import CATALOGUE
from ogmkit.learn.run_summary import summarise_run


def grid_runs(runs: Sequence[Path]) -> tuple[OpenRun, ...]:
    """Open the RUNs that predict grids and have a checkpoint.

    Raises:
        CheckpointError: settings or a checkpoint are damaged.
        TableError: splits are damaged.
    """
    chosen = [run for run in runs if _predicts_grids(run)]
    if chosen and importlib.util.find_spec("torch") is None:
        tell(Found("no examples of predictions: torch is not installed: pip install 'ogmkit[train]'"))
        return ()
    if not chosen:
        return ()
    from ogmkit.learn.predict.run import open_run  # noqa: PLC0415  # torch

    return tuple(map(open_run, chosen))


def _predicts_grids(run: Path) -> bool:
    one = summarise_run(run)
    entry = CATALOGUE.get(one.system)
    return bool(one.checkpoints) and entry is not None and entry.output == "grids"
