"""Rules about the files that tables name; how far extraction gets without them decides what they count."""

from collections.abc import Callable, Iterator
from pathlib import Path

from ogmkit.base.files import file_status, read_bytes
from ogmkit.base.images import image_size
from ogmkit.errors import OgmkitError
from ogmkit.nuscenes.decoded import DRIVABLE
from ogmkit.nuscenes.mask_files import mask_form, read_mask
from ogmkit.nuscenes.overview import is_present
from ogmkit.nuscenes.paths import resolve
from ogmkit.nuscenes.tables import Tables
from ogmkit.nuscenes.uses import Use

_LIDAR_POINT_BYTES = 20
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


def file_problems(tables: Tables, root: Path, use: Use, tick: Callable[[], None]) -> Iterator[Problem]:
    """Look at all files that a dataset's tables name.

    Args:
        tables: completely loaded and prepared.
        root: the dataset's.
        use: what the dataset is used for.
        tick: called for each file.
    """
    images = absent = 0
    for filename, channel, modality, height, width in tables.stream(_KEY_FILES):
        tick()
        if modality == "camera":
            fatal = use.images and channel in use.cameras
            problems = tuple(_image_problems(root, filename, (height, width), fatal))
            images += 1
            absent += any(rule == "R701" for rule, _, _ in problems)
            yield from problems
        else:
            yield from _lidar_problems(root, filename, channel == use.lidar)
    if images and absent == images:
        yield "R708", False, f"none of {images:,} images of key frames"
    for (filename,) in tables.stream(_OTHER_FILES):
        tick()
        if not is_present(root, filename):
            yield "R704", False, filename
    for filename, used, *extent_m in tables.rows(_MASKS):
        tick()
        yield from _mask_problems(root, filename, used and use.maps, extent_m)


def _image_problems(root: Path, filename: str, expected: tuple[int, int], fatal: bool) -> Iterator[Problem]:
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
