"""The whole of trainval on one machine: times, memory and ratios of the commands, in parts.

`python benchmarks/scale.py` makes a dataset of trainval's size (tables, masks, no images) and measures what
is missing, a part at a time: leave the machine alone meanwhile. `--plan` says how long it takes. What a
figure is compared with is measured in the same part, in turns.
"""

import json
import resource
import shutil
import subprocess
import sys
import time
from dataclasses import dataclass, replace
from pathlib import Path

from bench_command import run_bench
from bench_parts import Part
from big_tables import CAMERAS, Extent
from commands import OGMKIT
from scale_world import write_world
from tree import cost_of

from ogmkit.base.atomic import write_json
from ogmkit.shards import manifest
from ogmkit.shards.manifest import Manifest, ShardEntry, read_manifest, write_manifest
from ogmkit.shards.settings import ExtractSettings

NAME = "scale"
HERE = Path(__file__).resolve().parent
FIXTURE = HERE.parent / "fixtures" / "nuscenes-synthetic"
CAMERA = "CAM_FRONT"
WORKERS = 2
SMALLEST_MAP = "scene-0002"
"""A scene on the smallest map."""


@dataclass(frozen=True)
class Sizes:
    """What decides how long it takes."""

    scenes: int = 850
    rounds: int = 2
    many_scenes: int = 17_000
    long: int = 50
    short: int = 400
    entries: int = 1_000_000


TOY = Sizes(8, 1, 20, 2, 16, 1_000)


def parts_of(toy):
    """All parts, in order."""
    sizes = TOY if toy else Sizes()
    yield Part("world", 6, {"scenes": sizes.scenes}, make_data)
    for name, minutes, make in (
        ("first", 6, make_first),
        ("extract", 20, make_extract),
        ("tenth", 2, make_tenth),
        ("six-cameras", 15, make_six),
        ("resume", 2, make_resume),
        ("verify", 6, make_verify),
        ("check", 6, make_check),
        ("fit", 4, make_fit),
        ("footprints", 3, make_footprints),
    ):
        # Commands read what extract has written.
        needs = ("world",) if name in ("first", "extract") else ("world", "extract")
        needs = ("world", "tenth") if name in ("fit", "footprints") else needs
        yield Part(name, minutes, {"scenes": sizes.scenes, "rounds": sizes.rounds}, make, needs)
    many = {"scenes": sizes.many_scenes, "key_frames": 5, "sweeps": False}
    yield Part("many-scenes", 15, many, make_many)
    few = {"rounds": sizes.rounds, "long": sizes.long, "short": sizes.short}
    yield Part("constants", 8, few, make_constants, ("world", "first", "many-scenes"))
    yield Part("manifest", 2, {"entries": sizes.entries}, make_manifest)


def make_data(bench, part):
    """The dataset, without images; tells its rows and bytes."""
    root = _root(bench)
    shutil.rmtree(root, ignore_errors=True)
    rows = write_world(root, Extent(part.settings["scenes"]))
    names = [f"scene-{number:04d}" for number in range(part.settings["scenes"])]
    write_json(root / "splits.json", {"train": names[::2], "val": names[1::2]})
    return {"rows": rows, "bytes": sum(path.stat().st_size for path in root.rglob("*.json"))}


def make_first(bench, part):
    """The first run of all, which also indexes the tables and decodes the masks."""
    cache = bench.folder / "cache"
    shutil.rmtree(cache, ignore_errors=True)
    return {"extract": _extract(bench, bench.at(part.name) / "shards", workers=WORKERS).told()}


def make_extract(bench, part):
    """With one and two workers, beside the bare calls of the same frames in two processes."""
    shards, bare = _shards(bench), bench.at(part.name) / "bare"
    found = {"one": [], "two": [], "bare": []}
    for _ in range(part.settings["rounds"]):
        found["bare"].append(_bare(bench, bare, part.settings["scenes"]))
        for name, workers in (("one", 1), ("two", WORKERS)):
            shutil.rmtree(shards, ignore_errors=True)
            found[name].append(_extract(bench, shards, workers=workers).told())
    return found | {"frames": _frames(shards), "bytes": _size(shards)}


def make_tenth(bench, part):
    """A tenth of the scenes: what a frame costs there."""
    out = bench.at(part.name) / "shards"
    scenes = ",".join(_scenes(bench)[:: max(1, part.settings["scenes"] // 85)])
    costs = []
    for _ in range(part.settings["rounds"]):
        shutil.rmtree(out, ignore_errors=True)
        costs.append(_extract(bench, out, "--scenes", scenes, workers=WORKERS).told())
    return {"extract": costs, "frames": _frames(out)}


def make_six(bench, part):
    """All six cameras."""
    out = bench.at(part.name) / "shards"
    shutil.rmtree(out, ignore_errors=True)
    cost = _extract(bench, out, workers=WORKERS, cameras=CAMERAS)
    told = {"extract": cost.told(), "frames": _frames(out), "bytes": _size(out)}
    shutil.rmtree(out)
    return told


def make_resume(bench, part):
    """The same command over what is finished."""
    return {"extract": _extract(bench, _shards(bench), workers=WORKERS).told()}


def make_verify(bench, part):
    """Beside checksums and decompression of the same files."""
    shards, count = _shards(bench), part.settings["scenes"]
    found = {"verify": [], "floor": []}
    for _ in range(part.settings["rounds"]):
        found["verify"].append(cost_of([OGMKIT, "verify", shards, "--workers", WORKERS]).told())
        found["floor"].append(max(one["seconds"] for one in _halves("read", count, shards)))
    return found | {"bytes": _size(shards)}


def make_check(bench, part):
    """Beside reading the tables' files."""
    root, found = _root(bench), {"check": [], "floor": []}
    for _ in range(part.settings["rounds"]):
        command = [OGMKIT, "check", root, "--images", "none", "--camera", CAMERA, "--workers", WORKERS]
        found["check"].append(cost_of(command).told())
        found["floor"].append(_floors(["tables", root])[0]["seconds"])
    return found


def make_fit(bench, part):
    """homography-fit of a tenth of the scenes, with one and two workers."""
    return _with_workers(bench, part, "homography-fit")


def make_footprints(bench, part):
    """render-footprints likewise."""
    return _with_workers(bench, part, "render-footprints")


def make_many(bench, part):
    """Tables of many scenes: opened for the first time and again, and what is to be done told."""
    root = bench.at(part.name) / "dataset"
    shutil.rmtree(root, ignore_errors=True)
    rows = write_world(root, Extent(**part.settings))
    out, cache = bench.at(part.name) / "shards", bench.at(part.name) / "cache"
    plan = [OGMKIT, "extract", root, out, "--camera", CAMERA, "--images", "none", "--dry-run"]
    costs = [cost_of([*plan, "--cache-dir", cache]).told() for _ in range(2)]
    return {"rows": rows, "plan": costs}


def make_constants(bench, part):
    """Commands that differ in what there is of one thing: table rows, scenes, frames, pixels of a map."""
    out, cold, warm = bench.at(part.name) / "shards", bench.at(part.name) / "cache", bench.folder / "cache"

    def measured(root, scenes, *options, cache=warm):
        costs = []
        for _ in range(part.settings["rounds"]):
            shutil.rmtree(out, ignore_errors=True)
            shutil.rmtree(cold, ignore_errors=True)
            command = [OGMKIT, "extract", root, out, "--camera", CAMERA, "--images", "none", *options]
            costs.append(cost_of([*command, "--scenes", ",".join(scenes), "--cache-dir", cache]).told())
        return costs

    found = {"start": measured(FIXTURE, ["scene-0001"], "--dry-run")}
    for kind, root in (("long", _root(bench)), ("short", bench.at("many-scenes") / "dataset")):
        names = [f"scene-{number:04d}" for number in range(part.settings[kind])]
        figures = {"scenes": len(names), "open": measured(root, names[:1], "--dry-run")}
        for workers in (1, WORKERS):
            figures[f"workers-{workers}"] = measured(root, names, "--workers", workers)
        found[kind] = figures | {"frames": _frames(out), "bytes": _size(out)}
    for name, cache in (("warm", warm), ("cold", cold)):
        found[f"map, {name}"] = measured(_root(bench), [SMALLEST_MAP], cache=cache)
    return found


def make_manifest(bench, part):
    """The manifest of a million scenes: written and read."""
    place = bench.at(part.name)
    entry = ShardEntry("", "", "singapore-onenorth", 40, 1_000_000, "0" * 64, ("train",))
    names = [f"scene-{number:07d}" for number in range(part.settings["entries"])]
    shards = tuple(replace(entry, scene=name, file=f"{name}.h5") for name in names)
    seconds = {}
    for what, act in (
        (
            "write",
            lambda: write_manifest(place, Manifest("v1.0-trainval", "/data", ExtractSettings(), shards)),
        ),
        ("read", lambda: read_manifest(place)),
    ):
        started = time.perf_counter()
        act()
        seconds[what] = round(time.perf_counter() - started, 2)
    peak_mib = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    return {"seconds": seconds, "bytes": (place / manifest.NAME).stat().st_size, "peak_mib": round(peak_mib)}


def _with_workers(bench, part, command):
    shards = bench.at("tenth") / "shards"
    found = {"frames": _frames(shards), "one": [], "two": []}
    for _ in range(part.settings["rounds"]):
        for name, workers in (("one", 1), ("two", WORKERS)):
            found[name].append(cost_of([OGMKIT, command, shards, "--overwrite", "--workers", workers]).told())
    return found


def _extract(bench, out, *options, workers, cameras=(CAMERA,)):
    where = [_root(bench), out, "--cache-dir", bench.folder / "cache"]
    chosen = ["--camera", ",".join(cameras), *options]
    return cost_of([OGMKIT, "extract", *where, *chosen, "--images", "none", "--workers", workers])


def _bare(bench, out, scenes):
    """Seconds of the slower of two processes."""
    shutil.rmtree(out, ignore_errors=True)
    out.mkdir(parents=True)
    seconds = max(_halves("bare", scenes, _root(bench), out, bench.folder / "cache"))
    shutil.rmtree(out)
    return seconds


def _halves(kind, count, *arguments):
    """What two processes tell that have half of the scenes each, side by side."""
    middle = count // 2
    return _floors([kind, *arguments, 0, middle], [kind, *arguments, middle, count])


def _floors(*calls):
    command = [sys.executable, HERE / "scale_floor.py"]
    running = [
        subprocess.Popen([*map(str, [*command, *one])], stdout=subprocess.PIPE, text=True) for one in calls
    ]
    told = [one.communicate()[0] for one in running]
    return [json.loads(one) for one in told]


def _root(bench):
    return bench.at("world") / "dataset"


def _shards(bench):
    return bench.at("extract") / "shards"


def _scenes(bench):
    splits = json.loads((_root(bench) / "splits.json").read_text())
    return sorted(name for names in splits.values() for name in names)


def _frames(shards):
    manifest = json.loads((shards / "manifest.json").read_text())
    return sum(one["frames"] for one in manifest["shards"])


def _size(shards):
    return sum(path.stat().st_size for path in shards.glob("*.h5"))


if __name__ == "__main__":
    sys.exit(run_bench(NAME, parts_of, __doc__, jobs=1))
