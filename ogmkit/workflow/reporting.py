"""The last step: one page that shows all that the others have made."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

from ogmkit.report.opened import grid_runs
from ogmkit.report.report import Means, write_report
from ogmkit.report.settings import ReportSettings
from ogmkit.report.sources import TABLES, Sources
from ogmkit.workflow.config import Config
from ogmkit.workflow.steps import REPORT, Call, Made, first_gone

FILE = "report.html"
_SETTINGS = ReportSettings()


@dataclass(frozen=True)
class WriteReport:
    """The report.

    Attributes:
        config: the whole configuration.
        needs: all other steps.
    """

    config: Config
    needs: tuple[str, ...]

    @property
    def name(self) -> str:
        """The command."""
        return REPORT

    @property
    def settings(self) -> Mapping[str, Any]:
        """What is shown."""
        return asdict(_SETTINGS)

    @property
    def exact(self) -> bool:
        """It follows from what the others have made."""
        return True

    def missing(self, files: Sequence[str]) -> str:
        """The file."""
        return first_gone(self.config.out, files)

    def run(self, call: Call) -> Made:
        """Gather and write."""
        config = self.config
        runs = tuple(config.run_folder(one.name) for one in config.trainings)
        tables = (config.out / "tables" / name for name in self._tables())
        sources = Sources(config.shards, runs, tuple(tables))
        means = Means(grid_runs(runs), config.source.data, config.workers, call.advance)
        write_report(config.out / FILE, sources, _SETTINGS, means)
        return Made((FILE,))

    def _tables(self) -> tuple[str, ...]:
        """Those of what the configuration scores; others may lie there from an earlier one."""
        scored = (self.config.grids, self.config.planners)
        return tuple(name for name, ones in zip(TABLES, scored, strict=True) if ones)
