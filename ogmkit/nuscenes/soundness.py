"""Whether what a scene's frames use is sound."""

from collections.abc import Sequence

from ogmkit.errors import TableError
from ogmkit.nuscenes.found import with_found
from ogmkit.nuscenes.paths import one_line
from ogmkit.nuscenes.rules import CONCERNS, Rule, find_violations
from ogmkit.nuscenes.tables import Tables

REMEDY = "extract the metadata archive again, or leave the scene out"


class Soundness:
    """Violations of rules among what scenes use; found once, where somebody first asks.

    Args:
        tables: that are looked at.
        no_maps: why the table of maps can't be read; None where it can.
    """

    def __init__(self, tables: Tables, no_maps: TableError | None) -> None:
        self.no_maps = no_maps
        self._tables = tables
        self._rules: dict[str, Rule] = {}

    def find(self) -> dict[str, Rule]:
        """All rules by their ids, once their violations stand in the table `violation`."""
        if not self._rules:
            self._rules = {rule.id: rule for rule in find_violations(self._tables)}
        return self._rules

    def require(self, scene: tuple[str, str], channels: Sequence[str], *, maps: bool) -> None:
        """Raise the first violation among what a scene's frames use.

        Args:
            scene: its token and name.
            channels: whose frames are used.
            maps: whether map masks are used.

        Raises:
            TableError: a record breaks a rule, or a channel has no key frame.
        """
        if maps and self.no_maps is not None:
            raise TableError(f"{self.no_maps}, or extract with --no-map", kind="map.json is unreadable")
        tables, rules = self._tables, self.find()
        token, name = scene
        broken = tables.rows(
            "SELECT rule, source, record, detail FROM violation "
            f"WHERE scene = $scene AND {CONCERNS} ORDER BY rowid LIMIT 1",
            {"scene": token, "channels": list(channels), "maps": maps},
        )
        for rule, source, record, detail in broken:
            shown = one_line(f"{record}: {with_found(tables, rule, source, record, detail)}")
            raise TableError(
                f"{tables.path(source)}: record {shown} [{rule}, {one_line(name)}]; {rules[rule].remedy}",
                kind=f"{rule}: {rules[rule].title}",
            )
        found = tables.rows("SELECT DISTINCT channel FROM key_frame WHERE scene = ?", [token])
        recorded = sorted(channel for (channel,) in found if channel is not None)
        for channel in channels:
            if channel not in recorded:
                raise TableError(
                    f"{tables.path('sample_data')}: {name} has no key frame of {channel}; "
                    f"there are: {', '.join(recorded) or 'none'}; {REMEDY}",
                    kind=f"no key frame of {channel}",
                )
