"""FIERY's sequences against what its code gave, and by hand."""

import numpy as np
import pytest

from ogmkit.errors import SettingsError
from ogmkit.labels.catalogue import PRESETS
from ogmkit.labels.sequences import fiery_sequence
from ogmkit.labels.warp import egomotion, inverted, matrix_of, vector_of, warped

FIERY = PRESETS["fiery"]


def compare(archive, key_frames, scenes, row):
    """Cells of each array that differ in one sequence."""
    tokens = archive["seq_tokens"][row].tolist()
    scene = next(scene for scene in scenes if tokens[0] in scene)
    found = fiery_sequence([key_frames[token] for token in scene], scene.index(tokens[2]), FIERY)
    np.testing.assert_allclose(found.egomotion, archive["seq_egomotion"][row], atol=2e-3)
    squared = archive["seq_centerness_d2"][row].astype(float)
    expected = {
        "instance": archive["seq_instance"][row],
        "in_present": archive["seq_instance_in_present_frame"][row],
        "offset": archive["seq_offset"][row],
        "flow": archive["seq_flow"][row],
    }
    different = {name: int((getattr(found, name) != array).sum()) for name, array in expected.items()}
    near = np.where(squared == 255, 0, np.exp(-squared / 9))
    wrong = np.where(squared == 255, found.centerness > 1.3e-4, abs(found.centerness - near) > 1e-12)
    return different | {"centerness": int(wrong.sum())}


def scenes_of(key_frames, root):
    """Tokens of each scene in temporal order."""
    found = {}
    for token, frame in key_frames.items():
        found.setdefault(frame.camera.scene_name, []).append(token)
    return list(found.values())


@pytest.mark.parametrize("row", [3, pytest.param(slice(None), marks=pytest.mark.slow)])
@pytest.mark.parametrize("data", ["real", "synthetic"])
def test_as_fiery_gave_them(request, peer_labels, key_frames, level_dataroot, data, row):
    root = level_dataroot if data == "synthetic" else request.getfixturevalue("partial_dataroot")
    archive, frames = np.load(peer_labels / f"fiery__{root.name}.npz"), key_frames(root)
    rows = [row] if isinstance(row, int) else range(len(archive["seq_tokens"]))
    for one in rows:
        assert not any(compare(archive, frames, scenes_of(frames, root), one).values())


def test_a_sequence_takes_two_frames_before_the_present_and_four_after(key_frames, level_dataroot):
    frames = list(key_frames(level_dataroot).values())[:6]
    with pytest.raises(SettingsError, match="key frame 2 of 6: a sequence takes 2 before and 4 after it"):
        fiery_sequence(frames, 2, FIERY)


def test_a_vector_and_its_matrix():
    vector = np.array([1.5, -2.0, 0.3, 0.1, -0.2, 0.7], np.float32)
    np.testing.assert_allclose(vector_of(matrix_of(vector)), vector, atol=1e-6)
    np.testing.assert_allclose(inverted(matrix_of(vector)) @ matrix_of(vector), np.eye(4), atol=1e-6)


def test_motion_ahead_of_half_a_cell_more_than_two_moves_a_map_back():
    pose, following = np.eye(4), np.eye(4)
    following[0, 3] = 1.0
    motion = vector_of(egomotion(pose, following))
    np.testing.assert_array_equal(motion, [-1, 0, 0, 0, 0, 0])
    there = np.zeros((200, 200), np.int64)
    there[100, 90] = 7  # 0 m ahead of the next frame is 1 m ahead of this one: two cells
    here = warped(there, vector_of(inverted(matrix_of(motion))))
    assert np.argwhere(here == 7).tolist() == [[102, 90]]
