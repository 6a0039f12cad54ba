import pytest
from click.testing import CliRunner
from ogmkit_cli.main import main

from ogmkit.base.stated import stated_fields
from ogmkit.errors import SettingsError
from ogmkit.learn.catalogue import CATALOGUE, all_settings, entry_of
from ogmkit.learn.presets import PRESETS, preset_values
from ogmkit.workflow.reading import config_of


@pytest.mark.parametrize("system", CATALOGUE)
@pytest.mark.parametrize("name", PRESETS)
def test_every_system_takes_every_preset(system, name):
    entry = CATALOGUE[system]
    settings = entry.settings.from_values(preset_values(entry, name))
    assert (settings == entry.settings()) == (name == "paper")


def test_presets_hold_settings_that_there_are():
    assert {name for values in PRESETS.values() for name in values} <= set(all_settings())


def test_planners_without_images_keep_their_number_of_epochs():
    assert "epochs" not in preset_values(entry_of("mid-to-end"), "fast")
    assert preset_values(entry_of("holistic"), "fast")["epochs"] == PRESETS["fast"]["epochs"]


def test_an_unknown_one_is_named():
    with pytest.raises(SettingsError, match="unknown preset 'tiny'; there are: paper, small, fast"):
        preset_values(entry_of("ved"), "tiny")


@pytest.mark.parametrize("preset_first", [True, False])
def test_options_come_before_a_file_and_a_file_before_a_preset(tmp_path, preset_first):
    yaml = pytest.importorskip("yaml", reason="torch is not installed: pip install 'ogmkit[train]'")
    (tmp_path / "own.yaml").write_text("epochs: 3\nlr: 0.5\n")
    given = [["--preset", "fast"], ["--config", str(tmp_path / "own.yaml")]]
    arguments = [word for words in (given if preset_first else given[::-1]) for word in words]
    result = CliRunner().invoke(
        main, ["train", "footprints", str(tmp_path), "--print-config", "--lr", "0.25", *arguments]
    )
    found = yaml.safe_load(result.stdout)
    assert (found["lr"], found["epochs"], found["image_size"]) == (0.25, 3, [128, 224])
    unsaid = {"decoder_width"}  # at its default, as in files of before there was one
    assert set(found) == {"system", *stated_fields(CATALOGUE["footprints"].settings)} - unsaid


def test_a_run_s_file_takes_them_for_all_or_for_one(tmp_path):
    values = {"data": "world", "out": "out", "homography": {}, "footprints": {"preset": "fast", "epochs": 5}}
    values["train"] = {"preset": "small", "lr": 0.5}
    config = config_of(values, tmp_path / "chain.yaml")
    first, second = config.homography.settings, config.footprints.settings
    assert (first.image_size, first.epochs, first.lr) == ((224, 400), 30, 0.5)
    assert (second.image_size, second.epochs, second.lr) == ((128, 224), 5, 1e-3)
    assert not config.notes
    with pytest.raises(SettingsError, match=r"chain.yaml: footprints: unknown preset 'fst'; did you mean"):
        config_of(values | {"footprints": {"preset": "fst"}}, tmp_path / "chain.yaml")
