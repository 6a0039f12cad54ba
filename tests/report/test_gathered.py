"""What is gathered of shards, held against numpy on the shards' own arrays."""

import itertools

import h5py
import numpy as np
import pytest

from ogmkit.homography.leave_out import RANGES_M
from ogmkit.report import distributions
from ogmkit.report.homographies import collected
from ogmkit.report.part import Task, read_part
from ogmkit.report.thumbnails import PHOTO_BYTES, PLANE_BYTES
from ogmkit.shards.manifest import read_manifest


@pytest.fixture(scope="module")
def parts(sample_shards):
    manifest = read_manifest(sample_shards)
    return [read_part(Task(sample_shards, entry, 3, {}, None)) for entry in manifest.shards]


def cameras(folder):
    """Each camera's group of each shard."""
    for entry in read_manifest(folder).shards:
        with h5py.File(folder / entry.file, locking=False) as h5:
            yield from (h5[camera] for camera in sorted(h5))


def vehicles(group):
    """Frame of each vehicle, and its distance from that frame's ego."""
    offsets = group["boxes/offsets"][:]
    for frame, (first, stop) in enumerate(itertools.pairwise(offsets)):
        for box in range(first, stop):
            if group["boxes/category"].asstr()[box].startswith("vehicle."):
                centre = group["boxes/global_from_box"][box][:, 3]
                x, y = (group["level_from_global"][frame] @ centre)[:2]
                yield frame, float(np.hypot(x, y))


def binned(values, edges):
    last = (edges[-2] + edges[-1]) / 2
    return np.histogram(np.minimum(values, last), edges)[0]


def test_drivable_shares(parts, sample_shards):
    expected = sum(
        binned(group["drivable"][:].mean(axis=(1, 2)), distributions.SHARE)
        for group in cameras(sample_shards)
    )
    found = distributions.total(part.distributions for part in parts)
    assert found.drivable.tolist() == expected.tolist()
    assert found.drivable.sum() == sum(part.summary.frames for part in parts)


def test_vehicles_by_range_and_by_frame(parts, sample_shards):
    ranges, counts = [], []
    for group in cameras(sample_shards):
        found = list(vehicles(group))
        ranges += [distance for _, distance in found]
        counts += np.bincount([frame for frame, _ in found], minlength=len(group["sample_token"])).tolist()
    total = distributions.total(part.distributions for part in parts)
    assert total.ranges.tolist() == binned(np.array(ranges), distributions.RANGE_M).tolist()
    assert total.crowd.tolist() == binned(np.array(counts), distributions.CROWD).tolist()


def test_speeds_and_futures(parts, sample_shards):
    speeds, points = [], []
    for group in cameras(sample_shards):
        known = group["trajectory/past_valid"][:, -1]
        last = group["trajectory/past"][:][known, -1]
        speeds += (np.linalg.norm(last, axis=1) / 0.5).tolist()
        points.append(group["trajectory/future"][:][group["trajectory/future_valid"][:]])
    total = distributions.total(part.distributions for part in parts)
    assert total.speed.tolist() == binned(np.array(speeds), distributions.SPEED_M_S).tolist()
    x, y = np.concatenate(points).T
    expected = np.histogram2d(x, y, (distributions.AHEAD_M, distributions.ASIDE_M))[0]
    assert total.ways.tolist() == expected.tolist()
    assert total.ways.sum() > 0


def test_homographies(parts, sample_shards):
    found = {one.method: one for one in collected(part.homographies for part in parts).methods}
    assert set(found) == {"calibration", "dlt", "surface"}
    valid = sum(int(group["homography/dlt/valid"][:].sum()) for group in cameras(sample_shards))
    assert (found["dlt"].valid, found["dlt"].frames) == (valid, 32)
    low, high = RANGES_M[0]
    errors = []
    for group in cameras(sample_shards):
        error = group["homography/surface/left_out_error_m"][:]
        positions = np.einsum(
            "nij,nj->ni",
            np.repeat(group["level_from_global"][:], np.diff(group["boxes/offsets"][:]), axis=0),
            group["boxes/global_from_box"][:, :, 3],
        )
        distance = np.hypot(*positions[:, :2].T)
        errors += error[(distance >= low) & (distance < high) & ~np.isnan(error)].tolist()
    assert found["surface"].ranges[0].median_m == pytest.approx(np.median(errors), rel=1e-12)


def test_frames_have_pictures_within_their_bounds(parts):
    for part in parts:
        assert len(part.frames) == len(part.pictures) == 3
        for photo, *planes in part.pictures:
            assert len(photo) <= 4 * PHOTO_BYTES / 3 + 4
            assert len(planes) == 2
            assert all(len(plane) <= 4 * PLANE_BYTES / 3 + 4 for plane in planes)


def test_what_frames_lack_is_told_with_them(parts, sample_shards):
    frames = [frame for part in parts for frame in part.frames]
    assert any("trajectory: " in lack for frame in frames for lack in frame.lacks)
    manifest = read_manifest(sample_shards)
    with h5py.File(sample_shards / manifest.shards[0].file, locking=False) as h5:
        for frame in parts[0].frames:
            valid = h5[f"{frame.camera}/trajectory/valid"][frame.index]
            assert valid == (not any(lack.startswith("trajectory: ") for lack in frame.lacks))
            assert frame.drivable == h5[f"{frame.camera}/drivable"][frame.index].mean()
