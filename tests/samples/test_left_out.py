"""Sequences take no frame in the place of one that is left out, whatever the rate."""

import json

import h5py
import numpy as np
import pytest

from ogmkit.errors import ShardError, TrainingError
from ogmkit.grid import GridSpec
from ogmkit.samples.index import index_frames, index_sequences
from ogmkit.samples.requirements import require_drivable
from ogmkit.samples.spec import SampleSpec
from ogmkit.shards.manifest import AMENDING, Manifest, ShardEntry, read_manifest, write_manifest
from ogmkit.shards.settings import ExtractSettings
from ogmkit.target_settings import TargetSettings

SCENE, CAMERA = "scene-0001", "CAM_FRONT"


@pytest.fixture
def make(tmp_path):
    """A folder with one shard of frames at some times, some of them left out: `make(times_us, lost)`."""

    def write(times_us, lost, **targets):
        settings = ExtractSettings(TargetSettings(GridSpec(0.5, 4, 4, 4, 2), images="none", **targets))
        with h5py.File(tmp_path / f"{SCENE}.h5", "w") as h5:
            attributes = {"format": "ogmkit-shard", "format_version": 1, "scene": SCENE}
            h5.attrs.update(attributes, settings=json.dumps(settings.to_dict()))
            here = np.setdiff1d(np.arange(len(times_us)), lost)
            h5[f"{CAMERA}/timestamp_us"] = times_us[here]
            h5[f"{CAMERA}/sample_token"] = [f"s{i}" for i in here]
            if len(lost):
                h5[f"{CAMERA}/left_out/timestamp_us"] = times_us[lost]
                h5[f"{CAMERA}/left_out/sample_data_token"] = [f"d{i}" for i in lost]
        entry = ShardEntry(SCENE, f"{SCENE}.h5", "boston-seaport", len(here), 1, "", ())
        write_manifest(tmp_path, Manifest("v1.0-mini", "nuscenes", settings, (entry,)))
        (tmp_path / AMENDING).write_text('{"command": "homography-fit"}')  # sizes are not compared
        return tmp_path

    return write


def _ends(out):
    """The last frames of the sequences that there are."""
    index = index_sequences(out, [SCENE], [CAMERA], needs=SampleSpec(), whole_trajectory=False)
    return index.frame.tolist()


def test_at_two_hertz_the_sequences_that_need_the_image_break(make):
    times_us = 10**15 + 500_000 * np.arange(14)
    assert _ends(make(times_us, [])) == list(range(5, 14))
    # Frame 7 is needed by those that end at 7 … 12; frame 13 is the 12th of those that are here.
    assert _ends(make(times_us, [7])) == [5, 6, 12]


def test_at_ten_hertz_the_next_frame_does_not_step_in(make):
    """A step is five frames, so that 30, 35, … 55 need frame 30. Without it 29 or 31 would be near enough.

    So near the first frame is to the step before it for the sequences that end at 23 and 24.
    """
    times_us = 10**15 + 100_000 * np.arange(60)
    assert _ends(make(times_us, [])) == list(range(23, 60))
    broken = {30, 35, 40, 45, 50, 55}
    expected = [i - (i > 30) for i in range(23, 60) if i not in broken]
    assert _ends(make(times_us, [30])) == expected


def test_where_all_break_that_is_said(make):
    times_us = 10**15 + 500_000 * np.arange(8)
    with pytest.raises(
        TrainingError, match=r"none of 6 frames can be used .*0 have 5 images before it without"
    ):
        _ends(make(times_us, [2, 5]))


@pytest.mark.parametrize("needs", [SampleSpec((4, 4), masks="surface"), SampleSpec(bev_cell_m=1.0, bev=True)])
def test_what_needs_the_drivable_area_says_so_in_one_line(make, needs):
    out = make(10**15 + 500_000 * np.arange(8), [], no_map=True)
    with pytest.raises(
        ShardError,
        match=r"has no drivable area \(--no-map\), which is needed here; run `ogmkit extract nuscenes .*`",
    ):
        index_frames(out, [SCENE], [CAMERA], needs=needs)
    with pytest.raises(ShardError, match="has no drivable area"):
        require_drivable(out, read_manifest(out))
    assert len(index_frames(out, [SCENE], [CAMERA], needs=SampleSpec())) == 8
