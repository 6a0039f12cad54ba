"""What a chain needs is checked before anything is done."""

import json

import pytest

from ogmkit.errors import SettingsError, TableError
from ogmkit.workflow.needs import require_needs


def test_a_chain_that_has_what_it_needs_passes(tmp_path, chain_config):
    require_needs(chain_config(tmp_path / "out"))
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"scenes": ["scene-1"]}, "extract: .*: unknown scene 'scene-1'; did you mean scene-000"),
        ({"splits": ["test"]}, "extract: .*split"),
        ({"cameras": ["CAM_TOP"]}, "extract: .*: unknown camera 'CAM_TOP'"),
        ({"extract": {"categories": ["boat."]}}, "extract: .*boat"),
        (
            {"homography": {"train_split": "tran"}},
            r"train homography: split 'tran' has no scene .*: train \(1\), val \(1\); change train_split",
        ),
        (
            {"splits": ["train"]},
            r"train homography: split 'val' has no scene .*: train \(1\); change val_split",
        ),
        ({"scenes": ["scene-0002"]}, "train homography: split 'train' has no scene among those to extract"),
        ({"footprints": {"cameras": ["CAM_BACK"]}}, "train footprints: camera CAM_BACK is not extracted"),
        (
            {"extract": {"images": "none"}},
            "train homography: learns from images, which `images: none` leaves out",
        ),
        ({"evaluate": {"split": "test"}}, "evaluate perception: split 'test' .*; change split, scenes"),
    ],
)
def test_what_is_lacking_is_told_with_the_step_and_the_remedy(tmp_path, chain_config, changes, message):
    with pytest.raises(SettingsError, match=f"^{message}"):
        require_needs(chain_config(tmp_path / "out", **changes))


def test_planners_are_scored_on_a_split_that_is_there(tmp_path, chain_config):
    less = ("homography", "footprints")
    config = chain_config(tmp_path / "out", less, planners=["lstm-ed"], evaluate={"split": "test"})
    with pytest.raises(SettingsError, match=r"^evaluate planning: split 'test'"):
        require_needs(config)


def test_tables_are_about_test_where_it_is_there_else_about_val(tmp_path, chain_config):
    path = tmp_path / "splits.json"
    given = {"split_file": str(path), "train": {"val_split": "dev"}}
    path.write_text(json.dumps({"train": ["scene-0001"], "dev": ["scene-0002"], "test": ["scene-0002"]}))
    require_needs(chain_config(tmp_path / "out", **given))
    path.write_text(json.dumps({"train": ["scene-0001"], "dev": ["scene-0002"]}))
    with pytest.raises(SettingsError, match=r"^evaluate perception: split 'val' .* change split"):
        require_needs(chain_config(tmp_path / "out", **given))


def test_what_sees_no_images_needs_none(tmp_path, chain_config):
    less = ("homography", "footprints")
    require_needs(chain_config(tmp_path / "out", less, planners=["lstm-ed"], extract={"images": "none"}))


def test_a_split_file_counts(tmp_path, chain_config):
    path = tmp_path / "splits.json"
    path.write_text(json.dumps({"train": ["scene-0001"], "dev": ["scene-0002"]}))
    given = {"split_file": str(path), "evaluate": {"split": "dev"}}
    require_needs(chain_config(tmp_path / "out", train={"val_split": "dev"}, **given))
    with pytest.raises(
        SettingsError, match=r"^train homography: split 'val' .*: train .1., dev .1.; change val_split"
    ):
        require_needs(chain_config(tmp_path / "out", **given))


def test_no_dataset_is_the_first_steps_failure(tmp_path, chain_config):
    with pytest.raises(TableError, match=r"^extract: .*no such folder"):
        require_needs(chain_config(tmp_path / "out", data=str(tmp_path / "none")))
