"""Whether the groups that commands added to a shard agree with themselves and with the rest."""

from collections.abc import Iterator
from typing import Any

import numpy as np

from ogmkit.base.differences import differences
from ogmkit.homography.sources import sources_of
from ogmkit.shards.additions import added_values
from ogmkit.shards.crosschecks import first_wrong
from ogmkit.shards.reader import Shard
from ogmkit.shards.schema import FOOTPRINTS, HOMOGRAPHY
from ogmkit.typing import BoolArray


@np.errstate(invalid="ignore", divide="ignore")  # damaged numbers are findings
def added_problems(shard: Shard, camera: str) -> tuple[str, ...]:
    """Describe what contradicts itself in the groups added to one camera's, whose structure is sound.

    Masks are read frame by frame.

    Returns:
        A line for each contradiction, naming the dataset and the first frame or box.
    """
    checks = ((HOMOGRAPHY, _homography), (FOOTPRINTS, _footprints))
    return tuple(
        f"/{camera}/{kind.name}/{name}{problem}"
        for kind, check in checks
        for name in shard.added(camera, kind.name)
        for problem in check(shard, camera, name)
    )


def _homography(shard: Shard, camera: str, source: str) -> Iterator[str]:
    group = f"{HOMOGRAPHY.name}/{source}"
    matrices = shard.dataset(camera, f"{group}/bev_from_image")[:]
    valid = shard.dataset(camera, f"{group}/valid")[:]
    wrong = np.where(valid, ~np.isfinite(matrices).all(axis=(1, 2)), ~np.isnan(matrices).all(axis=(1, 2)))
    yield from first_wrong("/bev_from_image contradicts valid in", wrong)
    unscaled = valid & (np.abs(np.abs(matrices[:, 2, 2]) - 1) > 1e-9)
    yield from first_wrong("/bev_from_image is not of scale |h33| = 1 in", unscaled)
    # Image and grid have the same handedness, so w > 0 for ground in front goes with a positive determinant.
    reversed_sign = valid & (np.linalg.det(np.where(valid[:, None, None], matrices, 0.0)) <= 0)
    yield from first_wrong("/bev_from_image has no inverse or the wrong sign in", reversed_sign)
    given = np.array([bool(reason) for reason in shard.strings(camera, f"{group}/reason")], dtype=np.bool_)
    yield from first_wrong("/reason contradicts valid in", given == valid)
    for name in ("rms_px", "rms_cells"):
        yield from first_wrong(f"/{name} is negative in", shard.dataset(camera, f"{group}/{name}")[:] < 0)
    yield from _left_out(shard, camera, group)


def _left_out(shard: Shard, camera: str, group: str) -> Iterator[str]:
    names = [f"{group}/left_out_{name}" for name in ("error_m", "refused")]
    stored = [name in shard.h5[camera] for name in names]
    if not any(stored):
        return
    if not all(stored):
        yield "/left_out_error_m or left_out_refused is missing"
        return
    error_m, refused = (shard.dataset(camera, name)[:] for name in names)
    wrong = (error_m < 0) | (refused & ~np.isnan(error_m))
    yield from first_wrong("/left_out_error_m is negative or contradicts left_out_refused in", wrong, "box")


def _footprints(shard: Shard, camera: str, name: str) -> Iterator[str]:
    group = f"{FOOTPRINTS.name}/{name}"
    attributes = shard.attributes(f"{camera}/{group}")
    valid: BoolArray = shard.dataset(camera, f"{group}/valid")[:]
    for mask in ("vehicles",) if shard.settings.targets.no_map else ("drivable", "vehicles"):
        masks = shard.dataset(camera, f"{group}/{mask}")
        highest = np.array([masks[frame].max(initial=0) for frame in range(len(valid))], dtype=np.uint8)
        yield from first_wrong(f"/{mask} holds other values than 0 and 1 in", highest > 1)
        yield from first_wrong(f"/{mask} is filled although not valid in", (highest > 0) & ~valid)
        exact = shard.dataset(camera, "image_size")[:] / attributes["scale"]
        rounded: BoolArray = (np.abs(exact - masks.shape[1:]) <= 0.5 + 1e-9).all(axis=1)
        yield from first_wrong(f"/{mask} is not of the image's size / scale in", ~rounded)
    problem = origin_problem(shard, camera, name)
    if problem:
        yield f" {problem}"
    elif attributes["method"] == "warp":
        sources = [f"{HOMOGRAPHY.name}/{source}/valid" for source in _sources(attributes["homography"])]
        known = np.all([shard.dataset(camera, source)[:] for source in sources], axis=0)
        yield from first_wrong(f"/valid contradicts {' and '.join(sources)} in", valid != known)


def origin_problem(shard: Shard, camera: str, name: str) -> str:
    """Say why a set of footprints doesn't go with the homographies that are there now; empty if it does.

    Homographies may be fitted again, with other settings, after a set was warped by them.

    Raises:
        ShardError: the settings of either are no JSON.
    """
    values = added_values(shard, camera, FOOTPRINTS, name)
    if values is None or values["method"] != "warp":
        return ""
    known = shard.added(camera, HOMOGRAPHY.name)
    for source in _sources(values["homography"]):
        if source not in known:
            return f"is warped by homography {source!r}, which is not there"
    different = differences(fits_of(shard, camera, values["homography"]), values["settings"])
    if not different:
        return ""
    return (
        f"is warped by an earlier homography/{values['homography']} ({', '.join(different)}); "
        "run `ogmkit render-footprints` with --overwrite"
    )


def fits_of(shard: Shard, camera: str, homography: str) -> dict[str, Any]:
    """How the homographies that a set is warped by came about: the attributes of their groups, by their part.

    Args:
        shard: the shard.
        camera: channel.
        homography: a source that is there, or one for the drivable area and one for the vehicles.

    Raises:
        ShardError: their settings are no JSON.
    """
    parts = zip(("homography", "vehicles_homography"), _sources(homography), strict=False)
    return {part: added_values(shard, camera, HOMOGRAPHY, source) for part, source in parts}


def _sources(homography: str) -> tuple[str, ...]:
    """The sources that masks are warped by, each once."""
    return tuple(dict.fromkeys(sources_of(homography)))
