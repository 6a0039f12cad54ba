"""ST-P3's sequences against what its code gave."""

import numpy as np
import pytest

from ogmkit.errors import SettingsError
from ogmkit.labels.catalogue import PRESETS
from ogmkit.labels.occupancy import stp3_sequence

STP3 = PRESETS["stp3"]


@pytest.mark.parametrize("rows", [slice(0, 1), pytest.param(slice(None), marks=pytest.mark.slow)])
@pytest.mark.parametrize("data", ["real", "synthetic"])
def test_as_stp3_gave_them(request, peer_labels, key_frames, level_dataroot, data, rows):
    root = level_dataroot if data == "synthetic" else request.getfixturevalue("partial_dataroot")
    archive, frames = np.load(peer_labels / f"ST-P3__{root.name}.npz"), key_frames(root)
    shape = archive["seq_shape"]
    expected = np.unpackbits(archive["seq_packed"])[: np.prod(shape)].reshape(shape)
    assert archive["seq_classes"].tolist() == list(STP3.class_names)
    for present, sequence in list(zip(archive["seq_present"].tolist(), expected, strict=True))[rows]:
        scene = frames[present].camera.scene_name
        of_scene = [frame for frame in frames.values() if frame.camera.scene_name == scene]
        tokens = [frame.sample_token for frame in of_scene]
        found = stp3_sequence(of_scene, tokens.index(present), STP3)
        assert int((found != sequence).sum()) == 0


def test_a_sequence_takes_nine_frames(key_frames, level_dataroot):
    with pytest.raises(SettingsError, match="key frame 2 of 8: a sequence takes 2 before and 6 after it"):
        stp3_sequence(list(key_frames(level_dataroot).values())[:8], 2, STP3)
