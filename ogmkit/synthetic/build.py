"""`synthesize`: a whole nuScenes dataset out of nothing, from settings and a seed."""

import json
import shutil
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from filelock import FileLock, Timeout

from ogmkit.errors import OutputError
from ogmkit.synthetic.layout import Layout, Location, build_layout
from ogmkit.synthetic.mapfiles import write_expansion
from ogmkit.synthetic.mask import write_mask
from ogmkit.synthetic.plan import LogPlan, plan_scenes, split_scenes
from ogmkit.synthetic.recording import Recorder, count_files
from ogmkit.synthetic.sensors import Sensor, mounted_sensors
from ogmkit.synthetic.settings import SynthesisSettings
from ogmkit.synthetic.stage import build_stage
from ogmkit.synthetic.tables import Tables, add_log, add_map, add_vocabulary

_LONGEST_STEP_S = 0.6


@dataclass(frozen=True)
class SynthesisSummary:
    """What was made.

    Attributes:
        scenes: their names.
        locations: the maps used.
        samples: key frames.
        files: images and sweeps.
        annotations: annotated boxes.
    """

    scenes: tuple[str, ...]
    locations: tuple[str, ...]
    samples: int
    files: int
    annotations: int


def synthesize(
    out: Path, settings: SynthesisSettings, *, on_progress: Callable[[int, int], None] | None = None
) -> SynthesisSummary:
    """Make a dataset; `out` appears when it is whole, or not at all.

    Args:
        out: where to; absent or an empty folder, but not the current one.
        settings: what to make; the same settings give the same dataset.
        on_progress: called with files done and files in all.

    Raises:
        OutputError: `out` holds something, or can't be written.
    """
    if out.exists() and (not out.is_dir() or any(out.iterdir())):
        raise OutputError(f"{out}: not an empty folder; name another or remove it")
    if out.resolve() == Path.cwd():
        raise OutputError(f"{out}: is the current folder, which would be replaced; name one inside it")
    try:
        with _scratch(out) as making:
            summary = _make(making, settings, on_progress)
            if out.exists():
                out.rmdir()
            making.rename(out)
    except OSError as error:
        raise OutputError(f"{out}: {error.strerror or error}; check space and permissions") from error
    return summary


@contextmanager
def _scratch(out: Path) -> Iterator[Path]:
    """A place beside `out` for what is being made. What a killed run left there is removed.

    Raises:
        OutputError: another run is making the same dataset.
        OSError: the system refuses.
    """
    folder = out.with_name(f".{out.name}.making")
    folder.mkdir(parents=True, exist_ok=True)
    lock = FileLock(folder / "lock", timeout=0)
    try:
        lock.acquire()
    except Timeout as error:
        raise OutputError(f"{out}: another run is making it; wait for it") from error
    try:
        shutil.rmtree(folder / "dataset", ignore_errors=True)
        yield folder / "dataset"
    finally:
        shutil.rmtree(folder, ignore_errors=True)  # what can't be removed now, the next run removes
        lock.release()


def _make(
    out: Path, settings: SynthesisSettings, on_progress: Callable[[int, int], None] | None
) -> SynthesisSummary:
    duration_s = settings.frames * _LONGEST_STEP_S + 1.0
    plans = plan_scenes(settings.scenes, duration_s, settings.scenes_per_log)
    logs = list(dict.fromkeys(plan.log for plan in plans))
    tables = Tables(settings.seed)
    _make_folders(out, settings)
    add_vocabulary(tables, settings.channels)
    rigs = {log: _rig(log, settings) for log in logs}
    for log, sensors in rigs.items():
        add_log(tables, log, sensors)
    layouts = {log.location: build_layout(settings.seed, log.location) for log in logs}
    _write_maps(out, tables, layouts, logs, odd_areas=settings.odd_areas)
    annotations = 0
    counter = _Counter(sum(count_files(plan, settings) for plan in plans), on_progress)
    recorder = Recorder(out, tables, settings, counter.advance)
    for plan in plans:
        layout = layouts[plan.log.location]
        stage = build_stage(settings, plan, layout, duration_s)
        annotations += recorder.record(stage, rigs[plan.log])
    tables.write(out / settings.version)
    names = tuple(plan.name for plan in plans)
    (out / "splits.json").write_text(json.dumps(split_scenes(names), indent=1) + "\n", encoding="utf-8")
    locations = tuple(location.name for location in layouts)
    return SynthesisSummary(names, locations, len(plans) * settings.frames, counter.done, annotations)


class _Counter:
    """Counts files and tells."""

    def __init__(self, total: int, on_progress: Callable[[int, int], None] | None) -> None:
        self.done = 0
        self._total = total
        self._on_progress = on_progress

    def advance(self) -> None:
        self.done += 1
        if self._on_progress is not None:
            self._on_progress(self.done, self._total)


def _rig(log: LogPlan, settings: SynthesisSettings) -> tuple[Sensor, ...]:
    random = np.random.default_rng([settings.seed, 5, log.index]) if settings.relief_m else None
    return mounted_sensors(settings.channels, settings.image_size, random)


def _make_folders(out: Path, settings: SynthesisSettings) -> None:
    (out / settings.version).mkdir(parents=True)
    (out / "maps" / "expansion").mkdir(parents=True)
    for kind in ("samples", "sweeps") if settings.sweeps else ("samples",):
        for channel in settings.channels:
            (out / kind / channel).mkdir(parents=True)


def _write_maps(
    out: Path, tables: Tables, layouts: dict[Location, Layout], logs: list[LogPlan], *, odd_areas: bool
) -> None:
    for location, layout in layouts.items():
        filename = add_map(tables, location.name, [log for log in logs if log.location == location])
        write_mask(out / filename, layout.layers.drivable, location.size_m)
        path = out / "maps" / "expansion" / f"{location.name}.json"
        write_expansion(path, layout, tables.seed, odd_areas=odd_areas)
