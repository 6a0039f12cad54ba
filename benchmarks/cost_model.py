"""What an extraction of any size costs, by constants that `scale.py` has measured; checked and carried on.

Constants are solved from commands that differ in one thing: as many frames in few scenes and in many, tables
of two sizes, a map decoded and not. What they are checked against took no part in that.
"""

from dataclasses import dataclass

from big_tables import CAMERAS, LOCATIONS
from result_rows import NOT_RUN, row

PARTS = ("world", "first", "extract", "tenth", "six-cameras", "many-scenes", "constants", "manifest")
WORKERS = 2
DECODED = "singapore-onenorth"
"""The map that the constants' one decoded scene lies on."""

SIZES = (850, 10_000, 100_000, 1_000_000)
KEY_FRAMES = 40
DOLLARS_A_CORE_HOUR = 0.05
CORES = 256


@dataclass(frozen=True)
class Constants:
    """Seconds of a core, but for `open_row_s`, and bytes.

    Attributes:
        start_s: of a command that finds nothing to do.
        row_s: a row of the tables, read by the command.
        open_row_s: the same, in seconds of the clock: reading uses several cores.
        pixel_s: a pixel of a map's mask, decoded once a machine.
        read_s: a scene's rows, which the command reads one scene after the other; seconds of the clock.
        scene_s: a shard.
        frame_s: a frame of a camera.
        scene_bytes: of a shard.
        frame_bytes: a frame of a camera, without its image.
        entry_bytes: a shard's part of the manifest.
    """

    start_s: float
    row_s: float
    open_row_s: float
    pixel_s: float
    read_s: float
    scene_s: float
    frame_s: float
    scene_bytes: float
    frame_bytes: float
    entry_bytes: float


@dataclass(frozen=True)
class Work:
    """What an extraction has to do."""

    rows: int
    scenes: int
    frames: int
    pixels: int = 0


def constants(figures):
    """Solved from figures by part."""
    told, many = figures["constants"], sum(figures["many-scenes"]["rows"].values())
    start_s, start_clock_s = (_least(told["start"], name) for name in ("cpu_s", "wall_s"))
    long, short = told["long"], told["short"]
    by_kind = {
        "s": [_least(one[f"workers-{WORKERS}"]) - _least(one["open"]) for one in (long, short)],
        "bytes": [one["bytes"] for one in (long, short)],
    }
    scene, frame = ({}, {})
    for unit, (of_long, of_short) in by_kind.items():
        scene[unit], frame[unit] = _solved(long, of_long, short, of_short)
    rows, columns = LOCATIONS[DECODED]
    return Constants(
        start_s=start_s,
        row_s=(_least(short["open"]) - start_s) / many,
        open_row_s=(_least(short["open"], "wall_s") - start_clock_s) / many,
        pixel_s=(_least(told["map, cold"]) - _least(told["map, warm"])) / (rows * columns),
        read_s=(_least(figures["many-scenes"]["plan"], "wall_s") - _least(short["open"], "wall_s"))
        / figures["many-scenes"]["rows"]["scene"],
        scene_s=scene["s"],
        frame_s=frame["s"],
        scene_bytes=scene["bytes"],
        frame_bytes=frame["bytes"],
        entry_bytes=figures["manifest"]["bytes"] / figures["manifest"]["entries"],
    )


def core_s(found, work):
    """Seconds of a core."""
    return (
        found.start_s
        + found.row_s * work.rows
        + found.pixel_s * work.pixels
        + found.scene_s * work.scenes
        + found.frame_s * work.frames
    )


def clock_s(found, work, workers=WORKERS):
    """Seconds of the clock: tables are read first, then workers are as busy as the command can feed them."""
    opened_s = found.start_s + found.open_row_s * work.rows
    busy_s = core_s(found, work) - found.start_s - found.row_s * work.rows
    return opened_s + max(busy_s / workers, found.read_s * work.scenes)


def constants_table(bench):
    """The constants, in units that are easy to read."""
    figures = _figures(bench)
    if figures is None:
        return f"The constants are {NOT_RUN}."
    found = constants(figures)
    said = (
        ("the command", f"{found.start_s:.1f} s", ""),
        ("1,000 rows of tables", f"{1e6 * found.row_s:.2f} ms", ""),
        ("10⁶ pixels of a map's mask, once a machine", f"{1e9 * found.pixel_s:.1f} ms", "125 kB of cache"),
        ("a scene", f"{1e3 * found.scene_s:.0f} ms", f"{found.scene_bytes / 1e3:.0f} kB"),
        ("of that, what the command does, one scene after the other", f"{1e3 * found.read_s:.0f} ms", ""),
        (
            "a frame of a camera",
            f"{1e3 * found.frame_s:.2f} ms",
            f"{found.frame_bytes / 1e3:.1f} kB and its image",
        ),
        ("a scene in the manifest", "", f"{found.entry_bytes:.0f} bytes"),
    )
    lines = [row("what", "a core", "on disk"), row("---", "---:", "---:"), *(row(*one) for one in said)]
    return "\n".join(lines)


def checks_table(bench):
    """Predictions beside what was measured at other sizes."""
    figures = _figures(bench)
    header = [
        row("`extract`", "frames", "predicted", "measured", "predicted / measured"),
        row("---", *["---:"] * 4),
    ]
    if figures is None:
        return "\n".join([*header, row("all", NOT_RUN, "", "", "")])
    found = constants(figures)
    lines = [
        row(what, f"{work.frames:,}", f"{clock_s(found, work):.0f} s", f"{took_s:.0f} s",
            f"{clock_s(found, work) / took_s:.2f}")
        for what, work, took_s in _checks(figures)
    ]  # fmt: skip
    return "\n".join([*header, *lines])


def carried_on_table(bench):
    """The same constants at sizes that nobody measured."""
    header = [
        "scenes",
        "tables",
        "reading them",
        "core-hours",
        f"on {CORES} cores",
        "shards",
        "manifest",
        "cost",
    ]
    lines = [row(*header), row(*["---:"] * len(header))]
    figures = _figures(bench)
    if figures is None:
        return "\n".join([*lines, row(NOT_RUN, *[""] * (len(header) - 1))])
    found, world = constants(figures), figures["world"]
    rows = sum(world["rows"].values())
    pixels = sum(height * width for height, width in LOCATIONS.values())
    for scenes in SIZES:
        share = scenes / world["rows"]["scene"]
        work = Work(round(rows * share), scenes, scenes * KEY_FRAMES * len(CAMERAS), pixels)
        hours = core_s(found, work) / 3600
        stored = scenes * found.scene_bytes * len(CAMERAS) + work.frames * found.frame_bytes
        cells = (
            f"{scenes:,}",
            _size(world["bytes"] * share),
            _time(found.open_row_s * work.rows),
            f"{hours:,.3g}",
            _time(clock_s(found, work, CORES)),
            _size(stored),
            _size(scenes * found.entry_bytes),
            f"{hours * DOLLARS_A_CORE_HOUR:,.2f} $",
        )
        lines.append(row(*cells))
    return "\n".join(lines)


def _checks(figures):
    """(what, work, measured seconds of the clock) of sizes that took no part in the constants."""
    rows = sum(figures["world"]["rows"].values())
    scenes = figures["world"]["rows"]["scene"]
    pixels = sum(height * width for height, width in LOCATIONS.values())
    whole, tenth, six = figures["extract"], figures["tenth"], figures["six-cameras"]
    of_tenth = round(scenes * tenth["frames"] / whole["frames"])
    yield "a tenth of the scenes", Work(rows, of_tenth, tenth["frames"]), _least(tenth["extract"], "wall_s")
    yield "all scenes", Work(rows, scenes, whole["frames"]), _least(whole["two"], "wall_s")
    first_s = figures["first"]["extract"]["wall_s"]
    yield "all scenes, maps not decoded yet", Work(rows, scenes, whole["frames"], pixels), first_s
    yield "six cameras", Work(rows, scenes, six["frames"]), six["extract"]["wall_s"]


def _solved(long, of_long, short, of_short):
    """What a scene and a frame come to, of two mixtures of them."""
    frames = long["frames"] * short["scenes"] - short["frames"] * long["scenes"]
    frame = (of_long * short["scenes"] - of_short * long["scenes"]) / frames
    return (of_long - frame * long["frames"]) / long["scenes"], frame


def _least(costs, name="cpu_s"):
    return min(one[name] for one in costs)


def _time(seconds):
    for unit, size in (("days", 86_400), ("h", 3_600), ("min", 60)):
        if seconds >= size:
            return f"{seconds / size:.3g} {unit}"
    return f"{seconds:.2g} s"


def _size(count):
    for unit, size in (("TB", 1e12), ("GB", 1e9), ("MB", 1e6)):
        if count >= size:
            return f"{count / size:.3g} {unit}"
    return f"{count / 1e3:.3g} kB"


def _figures(bench):
    """Part → figures; None where one is missing."""
    records = {name: bench.record(name) for name in PARTS}
    if None in records.values():
        return None
    figures = {name: record["figures"] for name, record in records.items()}
    return figures | {"manifest": figures["manifest"] | records["manifest"]["settings"]}
