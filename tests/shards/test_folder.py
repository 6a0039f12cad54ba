import pytest

from ogmkit.errors import SettingsError, ShardError
from ogmkit.shards.folder import ShardFolder


def test_a_folder_tells_what_it_holds(sample_shards):
    folder = ShardFolder(sample_shards)

    assert folder.scenes == ("scene-0001", "scene-0002")
    assert folder.cameras == ("CAM_BACK", "CAM_FRONT")
    assert folder.grid == folder.manifest.settings.targets.grid
    assert folder.grid.shape == (60, 40)
    with folder.shard("scene-0002") as shard:
        assert shard.scene == "scene-0002"
        assert shard.path == folder.file("scene-0002") == sample_shards / "scene-0002.h5"


def test_what_is_not_there(sample_shards, tmp_path):
    with pytest.raises(SettingsError, match=r"/out: unknown scene 'scene-0003'; did you mean scene-0002"):
        ShardFolder(sample_shards).shard("scene-0003")
    with pytest.raises(ShardError, match=r"manifest\.json: can't be read"):
        ShardFolder(tmp_path)
