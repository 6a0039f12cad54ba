"""Rules about the files that tables name; how far extraction gets without them decides what they count."""

from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import closing
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import Any

from ogmkit.base.execution import Execution, run_over
from ogmkit.base.files import file_status, read_bytes
from ogmkit.base.images import image_size
from ogmkit.base.names import with_number
from ogmkit.base.news import Waiting, tell
from ogmkit.errors import OgmkitError
from ogmkit.nuscenes.decoded import DRIVABLE
from ogmkit.nuscenes.mask_files import mask_form, read_mask
from ogmkit.nuscenes.overview import is_present
from ogmkit.nuscenes.paths import resolve
from ogmkit.nuscenes.tables import Tables
from ogmkit.nuscenes.uses import Use

EXAMPLES = 3
"""First examples that a finding holds."""

_LIDAR_POINT_BYTES = 20
_FILES_READ, _FILES_FOUND = 100, 1000
"""Files of a part: of those that are read, and of those that only have to be there."""
MASK_M_PER_PIXEL = 0.1

_KEY_FILES = """
SELECT k.filename, k.channel, e.modality, k.height, k.width FROM key_frame k
JOIN sensor e ON e.token = k.sensor_token
WHERE k.filename IS NOT NULL
ORDER BY k.row
"""
_OTHER_FILES = """
SELECT filename FROM sample_data d ANTI JOIN key_frame k ON k.row = d.rowid
WHERE filename IS NOT NULL ORDER BY d.rowid
"""
_MASKS = """
SELECT m.filename, count(s.token) > 0, max(k.translation[1]), max(k.translation[2]),
    min(k.translation[1]), min(k.translation[2])
FROM map m
LEFT JOIN scene s ON list_contains(m.log_tokens, s.log_token)
LEFT JOIN key_frame k ON k.scene = s.token
WHERE m.filename IS NOT NULL
GROUP BY m.filename ORDER BY m.filename
"""

Problem = tuple[str, bool, str]
"""Rule's number, whether extraction for the use fails for it, and what is wrong with which file."""

FILE_RULES = {
    "R701": ("image is absent", "download it, or extract with --images none"),
    "R702": ("image is damaged or of another size", "download it again, or extract with --images none"),
    "R703": ("LiDAR sweep is absent or damaged", "download it, or extract without --lidar"),
    "R704": ("sweep or radar file is absent", "harmless: ogmkit reads key frames only"),
    "R705": ("map mask is absent or damaged", "extract the map archive again, or extract with --no-map"),
    "R706": ("ego drives outside its map mask", "check that map.json names the right mask"),
    "R707": ("map mask has no drivable pixel", "drivable is 255: invert or convert the mask"),
    "R708": (
        "no image of the tables is there",
        "tables of another release? choose them with --version; or download the images",
    ),
}
"""Number → title and remedy."""


@dataclass(frozen=True)
class _Part:
    """Files that are looked at in one go: rows of a query.

    Attributes:
        number: in the order of the findings' examples.
        root: the dataset's.
        use: what it is used for.
        query: that names them.
        rows: of its result.
    """

    number: int
    root: Path
    use: Use
    query: str
    rows: tuple[tuple[Any, ...], ...]


@dataclass(frozen=True)
class FileProblem:
    """A rule that files break.

    Attributes:
        count: how many do.
        examples: what is wrong with the first few.
    """

    count: int
    examples: tuple[str, ...]


Problems = Mapping[tuple[str, bool], FileProblem]
"""Rule's number, and whether extraction for the use fails for it → the files."""


@dataclass(frozen=True)
class _Seen:
    """What was found of a part.

    Attributes:
        number: of the part.
        files: how many it has.
        images: of these.
        problems: with them.
    """

    number: int
    files: int
    images: int
    problems: Problems


def file_problems(
    tables: Tables, root: Path, use: Use, execution: Execution, tick: Callable[[int], None]
) -> Problems:
    """Look at all files that a dataset's tables name.

    Args:
        tables: completely loaded and prepared.
        root: the dataset's.
        use: what the dataset is used for.
        execution: where the files are looked at.
        tick: called with the number of files each time that some have been looked at.
    """
    seen: list[_Seen] = []
    with closing(run_over(_look_at, _parts(tables, root, use), execution, shared=(root,))) as parts:
        for part in parts:
            tick(part.files)
            seen.append(part)
    problems = _joined(part.problems for part in sorted(seen, key=lambda part: part.number))
    images = sum(part.images for part in seen)
    absent = sum(one.count for (rule, _), one in problems.items() if rule == "R701")
    if images and absent == images:
        problems["R708", False] = FileProblem(1, (f"none of {images:,} images of key frames",))
    return problems


def _joined(found: Iterable[Problems]) -> dict[tuple[str, bool], FileProblem]:
    joined: dict[tuple[str, bool], FileProblem] = {}
    for problems in found:
        for key, one in problems.items():
            before = joined.get(key, FileProblem(0, ()))
            examples = (*before.examples, *one.examples)[:EXAMPLES]
            joined[key] = FileProblem(before.count + one.count, examples)
    return joined


def _parts(tables: Tables, root: Path, use: Use) -> Iterator[_Part]:
    """The masks are one part, since a decoded one takes a byte a pixel of memory; it is the longest."""
    masks = tuple(tables.rows(_MASKS))
    if masks:
        tell(Waiting(f"reading {with_number(len(masks), 'map mask')}"))
        yield _Part(0, root, use, _MASKS, masks)
    number = 1
    for query, size in ((_KEY_FILES, _FILES_READ), (_OTHER_FILES, _FILES_FOUND)):
        rows = iter(tables.stream(query))
        while part := tuple(islice(rows, size)):
            yield _Part(number, root, use, query, part)
            number += 1


def _look_at(part: _Part) -> _Seen:
    """Look at some files; runs in a worker."""
    problems = tuple(_problems_of(part))
    images = sum(modality == "camera" for _, _, modality, *_ in part.rows) if part.query == _KEY_FILES else 0
    found = _joined({(rule, fatal): FileProblem(1, (text,))} for rule, fatal, text in problems)
    return _Seen(part.number, len(part.rows), images, found)


def _problems_of(part: _Part) -> Iterator[Problem]:
    root, use = part.root, part.use
    for filename, *about in part.rows:
        if part.query == _MASKS:
            used, *extent_m = about
            yield from _mask_problems(root, filename, used and use.maps, extent_m)
        elif part.query == _OTHER_FILES:
            if not is_present(root, filename):
                yield "R704", False, filename
        else:
            channel, modality, *expected = about
            if modality == "camera":
                fatal = use.images and channel in use.cameras
                yield from _image_problems(root, filename, tuple(expected), fatal)
            else:
                yield from _lidar_problems(root, filename, channel == use.lidar)


def _image_problems(root: Path, filename: str, expected: tuple[int, ...], fatal: bool) -> Iterator[Problem]:
    if not is_present(root, filename):
        yield "R701", fatal, filename
        return
    try:
        size = image_size(read_bytes(resolve(root, filename)))
    except (OSError, ValueError) as error:
        yield "R702", fatal, f"{filename}: {_reason(error)}"
        return
    if size != expected:
        (height, width), (rows, columns) = expected, size
        yield "R702", fatal, f"{filename}: {columns} × {rows} pixels, but {width} × {height} in the table"


def _lidar_problems(root: Path, filename: str, fatal: bool) -> Iterator[Problem]:
    try:
        size = file_status(resolve(root, filename)).st_size
    except (OSError, OgmkitError) as error:
        yield "R703", fatal, f"{filename}: {_reason(error)}"
        return
    if size == 0 or size % _LIDAR_POINT_BYTES:
        yield "R703", fatal, f"{filename}: {size} bytes are no whole number of points"


def _mask_problems(root: Path, filename: str, used: bool, extent_m: list[float | None]) -> Iterator[Problem]:
    try:
        path = resolve(root, filename)
        if used:  # to its last byte, as extraction does
            mask = read_mask(path)
            width, height = mask.size
            if not mask.histogram()[DRIVABLE]:
                yield "R707", False, filename
        else:
            _, (height, width) = mask_form(path)
    except (OSError, OgmkitError) as error:
        yield "R705", used, f"{filename}: {_reason(error).removeprefix(f'{root / filename}: ')}"
        return
    x_max, y_max, x_min, y_min = extent_m
    if x_max is None or y_max is None or x_min is None or y_min is None:
        return
    if not (
        0 <= x_min <= x_max <= width * MASK_M_PER_PIXEL and 0 <= y_min <= y_max <= height * MASK_M_PER_PIXEL
    ):
        yield "R706", False, f"{filename}: {width} × {height} pixels, ego up to ({x_max:.0f}, {y_max:.0f}) m"


def _reason(error: Exception) -> str:
    """Why a file can't be read; the line names it anyway."""
    if isinstance(error, FileNotFoundError):
        return "absent"
    return str(error.strerror if isinstance(error, OSError) else error)
