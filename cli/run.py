"""`ogmkit run`: the whole chain."""

from __future__ import annotations

from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING

import click

from ogmkit.base.files import read_text

from .command import Command
from .logs import note
from .options import json_option
from .paths import EXISTING_FILE
from .progress import progress
from .text import json_text, one_line, text_table, with_number

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from ogmkit.evaluation.planning.result import PlanEvaluation
    from ogmkit.evaluation.result import Evaluation
    from ogmkit.workflow.chain import ChainSummary
    from ogmkit.workflow.config import Config
    from ogmkit.workflow.engine import StepReport

UP_TO_DATE, TO_DO = "up to date", "to be done"


@click.command(
    cls=Command,
    examples=(
        "ogmkit run chain.yaml --plan",
        "ogmkit run chain.yaml",
    ),
)
@click.argument("config", type=EXISTING_FILE)
@click.option(
    "--plan", "planning", is_flag=True, help="Show which steps would be done, and why; write nothing."
)
@json_option
def command(config: Path, planning: bool, as_json: bool) -> None:
    """Run the whole chain: shards, networks, both tables.

    CONFIG is a YAML file: the dataset (`data`), a folder for everything (`out`), and settings of the steps by
    the names that the single commands give them; see examples/ in the repository. The steps: extract,
    homography-fit, train and predict homography, render-footprints, train footprints, baselines and planners,
    evaluate, report. OUT gets shards/, runs/, tables/, pictures/, config.yaml, report.html, which shows all
    of it, and manifest.json, which says what made what.

    A step that is up to date is skipped; a changed setting rebuilds what depends on it, and nothing else.
    Interrupted at any moment, the same command resumes, and ends with the same tables. What a step needs of
    the dataset and of the steps before it is checked before anything is done.

    Fields of --plan --json: out, steps (a list: step, state (up to date or to be done), reason), left
    (folders of trainings that CONFIG no longer names).
    """
    if as_json and not planning:
        raise click.UsageError("--json goes with --plan.")
    from .extras import require_train

    require_train()
    from ogmkit.workflow.reading import read_config

    chosen = read_config(config)
    for line in chosen.notes:
        note(f"ogmkit: {line}")
    if planning:
        _show_plan(chosen, as_json)
        return
    from ogmkit.workflow.chain import run_chain

    with ExitStack() as stack:
        display = _Display(stack)
        summary = run_chain(
            chosen, writers=_writers(), on_step=display.on_step, on_progress=display.on_progress
        )
    _show(chosen, summary)


class _Display:
    """A line on stderr for each step; while some are under way, a bar.

    Args:
        stack: closes the bar, whatever ends the run.
    """

    def __init__(self, stack: ExitStack) -> None:
        self._stack = stack
        self._under_way: list[str] = []
        self._advance: Callable[[int, int], None] | None = None

    def on_step(self, report: StepReport) -> None:
        """Tell of a step."""
        self._stack.close()
        if report.state == "begun":
            self._under_way.append(report.name)
        else:
            self._under_way = [name for name in self._under_way if name != report.name]
            took = UP_TO_DATE if report.state == "skipped" else f"{report.seconds:.1f} s"
            detail = f"; {report.detail}" if report.detail else ""
            number = f"{report.number:>{len(str(report.total))}}/{report.total}"
            note(f"{number} {report.name}: {took}{detail}")
        self._advance = None
        if self._under_way:
            several = len(self._under_way) > 1
            shown = with_number(len(self._under_way), "step") if several else self._under_way[0]
            self._advance = self._stack.enter_context(progress(None, "", shown))

    def on_progress(self, done: int, total: int) -> None:
        """Move the bar."""
        if self._advance is not None:
            self._advance(done, total)


def _writers() -> dict[str, Callable[[Evaluation | PlanEvaluation], str]]:
    """Headline tables as this command prints them, kept beside all tables in other formats."""
    from ogmkit.evaluation.formats import report_of

    from .evaluate_text import report_text

    return {"txt": lambda evaluation: report_text(report_of(evaluation, all_tables=False))}


def _show_plan(config: Config, as_json: bool) -> None:
    from ogmkit.workflow.chain import left_runs, plan_chain

    steps = [
        {"step": step.name, "state": UP_TO_DATE if step.action == "skip" else TO_DO, "reason": step.reason}
        for step in plan_chain(config, _writers())
    ]
    left = left_runs(config)
    if as_json:
        click.echo(json_text({"out": config.out, "steps": steps, "left": left}))
        return
    click.echo(text_table(("step", "state", "reason"), [tuple(map(one_line, one.values())) for one in steps]))
    _show_left(left)


def _show(config: Config, summary: ChainSummary) -> None:
    """The tables, and where everything is."""
    for path in summary.tables:
        if path.suffix == ".txt":
            click.echo(read_text(path))
    _show_left(summary.left)
    pictures = with_number(len(summary.pictures), "picture")
    click.echo(
        f"{config.out}: tables/, pictures/ ({pictures}), runs/, shards/; manifest.json says what made what"
    )
    click.echo(f"{summary.report}: open it in a browser; it shows all of this")


def _show_left(left: Sequence[Path]) -> None:
    for path in left:
        click.echo(f"{path}: not in the configuration; left as it is, and not evaluated")
