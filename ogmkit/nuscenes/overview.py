"""What a dataset holds, counted: `ogmkit inspect`."""

import errno
import os
from collections import Counter, defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from ogmkit.errors import TableError
from ogmkit.nuscenes.paths import resolve
from ogmkit.nuscenes.tables import Tables

_ABSENT = (errno.ENOENT, errno.ENOTDIR, errno.ELOOP, errno.ENAMETOOLONG)

_SCENES = """
SELECT s.token, coalesce(s.name, ''), coalesce(l.location, ''),
    (SELECT count(*) FROM sample f WHERE f.scene_token = s.token),
    (SELECT count(*) FROM sample_annotation a JOIN sample f ON f.token = a.sample_token
        WHERE f.scene_token = s.token)
FROM scene s LEFT JOIN log l ON l.token = s.log_token
ORDER BY s.name
"""
_IMAGES = """
SELECT k.scene, k.channel, k.filename FROM key_frame k
JOIN sensor e ON e.token = k.sensor_token
WHERE e.modality = 'camera'
"""
_KEY_FILES = """
SELECT coalesce(s.name, s.token), k.channel, k.filename FROM key_frame k JOIN scene s ON s.token = k.scene
WHERE list_contains(?, k.channel) AND k.filename IS NOT NULL
ORDER BY k.row
"""
_MASKS = """
SELECT coalesce(s.name, s.token), '', m.filename FROM scene s
JOIN map m ON list_contains(m.log_tokens, s.log_token)
WHERE m.filename IS NOT NULL
ORDER BY s.rowid, m.rowid
"""


@dataclass(frozen=True)
class SceneOverview:
    """Counts of one scene.

    Attributes:
        name: the scene's.
        location: the map's name.
        frames: key frames.
        cameras: channel names, sorted.
        boxes: annotations.
        images: key-frame images that the tables name.
        images_present: those whose files are there.
    """

    name: str
    location: str
    frames: int
    cameras: tuple[str, ...]
    boxes: int
    images: int
    images_present: int


def scene_overviews(tables: Tables, root: Path) -> tuple[SceneOverview, ...]:
    """Counts of every scene, sorted by name; damaged records simply count for less."""
    cameras: defaultdict[str, set[str]] = defaultdict(set)
    images: Counter[str] = Counter()
    present: Counter[str] = Counter()
    for scene, channel, filename in tables.stream(_IMAGES):
        cameras[scene].add(channel)
        images[scene] += 1
        present[scene] += is_present(root, filename)
    return tuple(
        SceneOverview(
            name=name,
            location=location,
            frames=frames,
            cameras=tuple(sorted(cameras[token])),
            boxes=boxes,
            images=images[token],
            images_present=present[token],
        )
        for token, name, location, frames, boxes in tables.rows(_SCENES)
    )


def key_files(tables: Tables, channels: Sequence[str], *, maps: bool) -> Iterator[tuple[str, str, str]]:
    """Scene, channel and name of the files of key frames, then of map masks, whose channel is empty.

    Args:
        tables: loaded and prepared (`uses.prepare`).
        channels: of cameras and LiDARs.
        maps: whether map masks are wanted.
    """
    yield from tables.stream(_KEY_FILES, [list(channels)])
    if maps:
        yield from tables.rows(_MASKS)


def is_present(root: Path, filename: str | None) -> bool:
    """Whether a file that a table names is there; one that leaves the root is not.

    One that the system refuses to look at may be there: whoever reads it is told why it can't be read.
    """
    if filename is None:
        return False
    try:
        os.stat(resolve(root, filename))
    except (TableError, ValueError):
        return False
    except OSError as error:
        return error.errno not in _ABSENT
    return True
