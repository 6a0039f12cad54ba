"""Whether what a scene's frames use is sound."""

from collections.abc import Mapping, Sequence

from ogmkit.errors import TableError
from ogmkit.nuscenes.found import with_found
from ogmkit.nuscenes.paths import one_line
from ogmkit.nuscenes.rules import CONCERNS, Rule
from ogmkit.nuscenes.tables import Tables

REMEDY = "extract the metadata archive again, or leave the scene out"


def require_sound(
    tables: Tables, rules: Mapping[str, Rule], scene: tuple[str, str], channels: Sequence[str], *, maps: bool
) -> None:
    """Raise the first violation among what a scene's frames use.

    Args:
        tables: where violations were found.
        rules: by their ids.
        scene: its token and name.
        channels: whose frames are used.
        maps: whether map masks are used.

    Raises:
        TableError: a record breaks a rule, or a channel has no key frame.
    """
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
