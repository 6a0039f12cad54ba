"""The first step: the shards of a dataset."""

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Self

from ogmkit.base.atomic import output_errors
from ogmkit.base.execution import Execution
from ogmkit.base.names import with_number
from ogmkit.nuscenes.dataset import Dataset
from ogmkit.nuscenes.splits import SPLITS_FILE, read_split_file
from ogmkit.nuscenes.versions import find_version
from ogmkit.pipeline.extract import extract
from ogmkit.pipeline.extract_summary import ExtractSummary, grouped
from ogmkit.pipeline.needed_files import fingerprint, needed_files
from ogmkit.pipeline.selection import select_scenes
from ogmkit.shards.manifest import AMENDING, MARKER, NAME, file_sha256, read_manifest
from ogmkit.shards.settings import LEAVING_OUT
from ogmkit.workflow.config import Config
from ogmkit.workflow.steps import EXTRACT, Call, Made, first_gone

_PICTURES = (".png", ".jpg", ".jpeg")
_DIGITS = 16
"""Of the dataset's checksum: a change is to be noticed, not an attack."""


@dataclass(frozen=True)
class Extract:
    """The shards of a dataset.

    Attributes:
        config: the whole configuration.
        version: folder of the tables.
        checksum: of all that the dataset says, without images and LiDAR.
        files: fingerprint of the images and LiDAR files present, where missing ones are left out; else empty.
    """

    config: Config
    version: str
    checksum: str
    files: str = ""

    @classmethod
    def of(cls, config: Config) -> Self:
        """The step, once the dataset's tables have been read through.

        Raises:
            TableError, SettingsError: there is no such dataset, version or split file.
        """
        version = find_version(config.source.data, config.source.version)
        files = _files(config, version) if config.extract.leaves_out else ""
        return cls(config, version, _checksum(config, version), files)

    @property
    def name(self) -> str:
        """The command."""
        return EXTRACT

    @property
    def needs(self) -> tuple[str, ...]:
        """Nothing: it is the first."""
        return ()

    @property
    def settings(self) -> Mapping[str, Any]:
        """What is extracted from which scenes."""
        source = self.config.source
        chosen = {"scenes": list(source.scenes), "splits": list(source.splits)}
        version = {"version": self.version, "dataset": self.checksum}
        extracted = self.config.extract.to_dict()
        if extracted["images"] == "reference":  # then the shards are of that place
            version["data"] = str(source.data.resolve())
        if self.config.extract.leaves_out:
            version["files"] = self.files
            chosen |= {name: getattr(self.config.extract, name) for name in LEAVING_OUT}
        return {**version, **chosen, **extracted}

    @property
    def exact(self) -> bool:
        """Shards follow from the dataset."""
        return True

    def missing(self, files: Sequence[str]) -> str:
        """The manifest or a shard."""
        return first_gone(self.config.out, files)

    def run(self, call: Call) -> Made:
        """Extract; shards of other settings go first, since one folder can't hold both.

        Raises:
            OgmkitError: a scene failed; the others are there.
        """
        config, source = self.config, self.config.source
        if call.overwrite:
            _remove_shards(config.shards)
            call.let_go()
        with Dataset(source.data, self.version) as dataset:
            summary = extract(
                dataset,
                config.shards,
                config.extract,
                scenes=select_scenes(dataset, source.scenes, source.splits, source.split_file),
                splits=dataset.splits(source.split_file),
                execution=Execution(config.workers, config.scheduler, on_progress=call.advance),
            )
        _require_scenes(summary)
        files = [NAME, *(entry.file for entry in read_manifest(config.shards).shards)]
        return Made(
            tuple(f"{config.shards.name}/{file}" for file in files),
            note=f"{with_number(summary.scenes, 'scene')}, {with_number(summary.frames, 'frame')}"
            f"{_left_out(summary)}",
        )


def _require_scenes(summary: ExtractSummary) -> None:
    """Stop where a scene failed, or all were left out."""
    failures = summary.failures or (() if summary.scenes else summary.left_out)
    if not failures:
        return
    first, scenes = failures[0].error, summary.scenes + len(summary.failures) + len(summary.left_out)
    reason = grouped(failures)[0].reason
    keys = " (keys of `extract` here, such as `skip_bad_frames: true`)" if "--" in reason else ""
    state = "failed" if summary.failures else "were left out"
    raise type(first)(
        f"{len(failures)} of {scenes} scenes {state}, first {failures[0].scene}: {reason}{keys}"
    )


def _left_out(summary: ExtractSummary) -> str:
    """What the shards lack, in words."""
    counts = {"scene": len(summary.left_out), "frame": summary.frames_left_out}
    lost = ", ".join(with_number(count, what) for what, count in counts.items() if count)
    return f"; left out: {lost}" if lost else ""


def _files(config: Config, version: str) -> str:
    source = config.source
    with Dataset(source.data, version) as dataset:
        chosen = select_scenes(dataset, source.scenes, source.splits, source.split_file)
        return fingerprint(needed_files(dataset, config.extract, chosen))


def _checksum(config: Config, version: str) -> str:
    """Of tables, maps and splits, by their content: a copy of the dataset is the same dataset."""
    source, root = config.source, config.source.data
    maps = () if config.extract.targets.no_map else (root / "maps").glob("*")
    masks = sorted(path for path in maps if path.suffix.lower() in _PICTURES)
    files = [*sorted((root / version).glob("*.json")), *masks]
    if (root / SPLITS_FILE).exists():
        files.append(root / SPLITS_FILE)
    contents: list[Any] = [[str(path.relative_to(root)), file_sha256(path)] for path in files]
    if source.split_file is not None:
        contents.append(read_split_file(source.split_file))
    return hashlib.sha256(json.dumps(contents).encode()).hexdigest()[:_DIGITS]


def _remove_shards(shards: Path) -> None:
    """Remove what an extraction wrote, and nothing else."""
    with output_errors(shards):
        for path in (*shards.glob("*.h5"), *(shards / name for name in (NAME, MARKER, AMENDING))):
            path.unlink(missing_ok=True)
