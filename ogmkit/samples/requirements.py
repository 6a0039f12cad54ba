"""What samples need of a folder of shards, and the commands that make what is missing."""

from collections.abc import Callable, Sequence
from pathlib import Path

from ogmkit.base.names import unknown
from ogmkit.errors import SettingsError, ShardError
from ogmkit.samples.spec import SampleSpec
from ogmkit.shards import schema
from ogmkit.shards.crosschecks_added import origin_problem
from ogmkit.shards.faults import H5_ERRORS, damaged
from ogmkit.shards.fields import COLUMNS, FRAMES, ROWS, AddedKind, parts_of
from ogmkit.shards.manifest import Manifest
from ogmkit.shards.reader import Shard
from ogmkit.shards.remedies import footprints_command, homography_command
from ogmkit.shards.schema_further import further_fields
from ogmkit.typing import BoolArray

_BINARY = "uint8", (FRAMES, ROWS, COLUMNS)
"""dtype and shape of rasters of 0 and 1."""


def require_extracted(out: Path, manifest: Manifest, needs: SampleSpec) -> None:
    """Check that drivable area, images and LiDAR points were extracted where they are needed.

    Raises:
        ShardError: they were not, or images are kept as paths into a dataset that is not there.
    """
    settings = manifest.settings.targets
    if needs.bev_parts is not None or needs.masks is not None or (needs.bev and "drivable" in needs.rasters):
        require_drivable(out, manifest)
    if needs.bev:
        _require_rasters(out, manifest, needs.rasters)
    command = again(out, manifest)
    if needs.lidar and not settings.lidar:
        raise ShardError(f"{out}: has no LiDAR points; run `{command} --lidar`")
    if needs.image_size is None or settings.images == "bytes":
        return
    if settings.images == "none":
        raise ShardError(f"{out}: has no images (--images none); run `{command} --images bytes`")
    if not Path(manifest.dataroot).is_dir():
        raise ShardError(
            f"{out}: its images lie in {manifest.dataroot}, which is absent; bring it back, or extract with "
            "--images bytes"
        )


def require_drivable(out: Path, manifest: Manifest) -> None:
    """Check that the shards know the drivable area.

    Raises:
        ShardError: they were made without maps.
    """
    if manifest.settings.targets.no_map:
        raise ShardError(
            f"{out}: has no drivable area (--no-map), which is needed here; run `{again(out, manifest)}`, "
            "with the map masks in place"
        )


def _require_rasters(out: Path, manifest: Manifest, names: Sequence[str]) -> None:
    """Check that the shards hold rasters of 0 and 1 of these names."""
    targets = manifest.settings.targets
    stored = (*schema.fields(parts_of(targets)), *further_fields(targets))
    known = tuple(one.name for one in stored if (one.dtype, one.shape) == _BINARY)
    for name in names:
        if name not in known:
            raise ShardError(
                f"{out}: {unknown('raster', name, known)}; for others, run `{again(out, manifest)}` with "
                "--layers or --classes"
            )


def again(out: Path, manifest: Manifest) -> str:
    """The command that rebuilds a folder's shards."""
    return f"ogmkit extract {manifest.dataroot} {out} --overwrite"


def valid_frames(shard: Shard, camera: str, needs: SampleSpec) -> dict[str, BoolArray]:
    """What needs to be valid → (N,) whether it is, over a camera's frames.

    Raises:
        ShardError: the shard lacks a homography or a set of masks, or is damaged.
    """
    valid: dict[str, BoolArray] = {}
    try:
        if needs.homography is not None:
            _require_homography(shard, camera, needs.homography)
            valid[f"a valid homography {needs.homography!r}"] = _column(
                shard, camera, f"{schema.HOMOGRAPHY.name}/{needs.homography}/valid"
            )
        if needs.masks is not None:
            _require_footprints(shard, camera, needs.masks)
            valid[f"valid footprints {needs.masks!r}"] = _column(
                shard, camera, f"{schema.FOOTPRINTS.name}/{needs.masks}/valid"
            )
        if needs.trajectory:
            valid["a valid trajectory"] = _column(shard, camera, "trajectory/valid")
    except H5_ERRORS as error:
        raise damaged(shard.path, error) from error
    return valid


def require_same_step(planner: Path, trained_s: float, step_s: float) -> None:
    """Refuse sequences of another step than a planner was trained on.

    Args:
        planner: its run.
        trained_s: step of the shards that it was trained on.
        step_s: of the sequences.

    Raises:
        SettingsError: they differ.
    """
    if trained_s != step_s:
        raise SettingsError(
            f"{planner}: was trained on images {trained_s:g} s apart, those of the shards are {step_s:g} s; "
            f"extract with --step {trained_s:g}, or train again"
        )


def _require_homography(shard: Shard, camera: str, source: str) -> None:
    _require_added(shard, camera, schema.HOMOGRAPHY, source, homography_command)


def _require_footprints(shard: Shard, camera: str, name: str) -> None:
    _require_added(shard, camera, schema.FOOTPRINTS, name, footprints_command)
    problem = origin_problem(shard, camera, name)
    if problem:
        raise ShardError(f"{shard.path}: {camera}/footprints/{name} {problem}")


def _require_added(
    shard: Shard, camera: str, kind: AddedKind, name: str, command: Callable[[Path, str], str]
) -> None:
    known = shard.added(camera, kind.name)
    if name not in known:
        raise ShardError(
            f"{shard.path}: {camera} has no {kind.name} {name!r} (it has {', '.join(known) or 'none'}); "
            f"run `{command(shard.path.parent, name)}`"
        )


def _column(shard: Shard, camera: str, name: str) -> BoolArray:
    values: BoolArray = shard.dataset(camera, name)[:]
    return values
