"""How sound shards and dataset are: what `verify` and `check` find, as far as both can be had."""

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, replace
from pathlib import Path

from ogmkit.base.execution import DEFAULT_EXECUTION, Execution
from ogmkit.errors import OgmkitError, UnreadableShardError
from ogmkit.nuscenes.check import Finding, check_dataset
from ogmkit.nuscenes.uses import Use
from ogmkit.report.settings import ReportSettings
from ogmkit.shards.faults import MAY_BE_SOUND
from ogmkit.shards.invalid import InvalidCount, InvalidFrames
from ogmkit.shards.left_out import LeftOutCount
from ogmkit.shards.manifest import Manifest
from ogmkit.shards.verify import Problem, verify_folder


@dataclass(frozen=True)
class Soundness:
    """What was found.

    Attributes:
        verified: problems of the shards; None where they were not verified.
        checked: rules that the dataset breaks; None where it was not checked.
        not_verified: why; empty where they were.
        not_checked: why; empty where it was.
    """

    verified: tuple[Problem, ...] | None
    checked: tuple[Finding, ...] | None
    not_verified: str = ""
    not_checked: str = ""


def examined(
    shards: Path,
    manifest: Manifest,
    dataroot: Path | None,
    settings: ReportSettings,
    execution: Execution = DEFAULT_EXECUTION,
) -> Soundness:
    """Verify the shards, and check the dataset where it is there.

    Args:
        shards: the folder.
        manifest: its manifest.
        dataroot: the dataset; None for the place that the manifest names, if that is a folder.
        settings: which of both to leave out.
        execution: how both are done; its progress is of shards verified.

    Raises:
        ShardError: as of `ogmkit.shards.verify.verify_folder`.
        UnreadableShardError: the system refuses to read a shard, of which nothing can be said then.
    """
    verified = None if settings.no_verify else _verified(shards, execution)
    checked, not_checked = _checked(manifest, dataroot, settings, replace(execution, on_progress=None))
    return Soundness(verified, checked, "--no-verify" if settings.no_verify else "", not_checked)


def _verified(shards: Path, execution: Execution) -> tuple[Problem, ...]:
    problems = verify_folder(shards, execution=execution)
    for one in problems:
        if MAY_BE_SOUND in one.message:
            raise UnreadableShardError(f"{shards / one.file}: {one.message}")
    return problems


def _checked(
    manifest: Manifest, dataroot: Path | None, settings: ReportSettings, execution: Execution
) -> tuple[tuple[Finding, ...] | None, str]:
    """Findings, or None and why there are none to be had."""
    if settings.no_check:
        return None, "--no-check"
    root = Path(manifest.dataroot) if dataroot is None else dataroot
    if not root.is_dir():
        return None, f"{root} is not there; --dataroot names another place"
    targets = manifest.settings.targets
    use = Use(
        tuple(manifest.settings.cameras),
        targets.images != "none",
        targets.lidar_source,
        not targets.no_map,
        targets.categories,
    )
    try:
        return check_dataset(root, manifest.dataset_version, use=use, execution=execution), ""
    except OgmkitError as error:
        return None, str(error)


def counted_invalid(found: Iterable[InvalidFrames]) -> tuple[InvalidCount, ...]:
    """Invalid frames over all scenes."""
    counts = Counter[tuple[str, str, str]]()
    for one in found:
        counts[one.camera, one.of, one.reason] += len(one.frames)
    return tuple(InvalidCount(*key, count) for key, count in sorted(counts.items()))


def counted_left_out(found: Iterable[LeftOutCount]) -> tuple[LeftOutCount, ...]:
    """Frames that are left out, over all scenes."""
    counts = Counter[tuple[str, str]]()
    for one in found:
        counts[one.camera, one.reason] += one.frames
    return tuple(LeftOutCount(*key, count) for key, count in sorted(counts.items()))
