"""The systems' settings: the paper's by default, each stated once and read by those that need it."""

import json
from dataclasses import fields
from typing import get_type_hints

import pytest

from ogmkit.base.stated import stated_fields
from ogmkit.errors import SettingsError
from ogmkit.learn.catalogue import CATALOGUE, readers, settings_from_dict


@pytest.mark.parametrize(
    ("system", "encoder", "lr"),
    [
        ("homography", "resnet18", 1e-3),
        ("footprints", "resnet101", 1e-3),
        ("ved", "vgg16_bn", 1e-3),
        ("oft", "resnet18", 1e-7),
        ("bev-lidar", "resnet101", 1e-3),
    ],
)
def test_the_papers_settings_of_stage_1_are_the_defaults(system, encoder, lr):
    settings = CATALOGUE[system].settings()
    assert (settings.encoder, settings.lr, settings.encoder_weights) == (encoder, lr, None)
    assert (settings.epochs, settings.batch_size, settings.optimizer, settings.clip_norm) == (
        100,
        8,
        "sgd",
        0,
    )


@pytest.mark.parametrize("system", ["lstm-ed", "end-to-end", "mid-to-end", "holistic", "holistic-cv"])
def test_the_papers_settings_of_stage_2_are_the_defaults(system):
    settings = CATALOGUE[system].settings()
    assert (settings.epochs, settings.batch_size, settings.lr, settings.momentum) == (200, 10, 1e-3, 0.9)
    assert (settings.hidden, settings.mean) == (128, "zero")


def test_oft_works_on_cells_of_a_metre_and_others_on_the_shards():
    assert [CATALOGUE[name].settings().bev_cell_m for name in ("oft", "ved", "bev-lidar")] == [
        1.0,
        None,
        None,
    ]


def test_settings_are_read_by_the_systems_that_need_them():
    assert readers("kl_weight") == ("ved",)
    assert readers("blocks") == readers("channels") == ("oft",)
    assert readers("head") == ("homography",)
    assert readers("warp") == ("holistic",)
    assert readers("masks") == readers("decoder_width") == ("footprints", "holistic", "holistic-cv")
    assert readers("no_past") == ("end-to-end", "mid-to-end", "holistic", "holistic-cv")
    assert readers("no_destination") == ("lstm-ed", "end-to-end", "mid-to-end", "holistic", "holistic-cv")
    assert readers("pool_cells") == ("mid-to-end", "holistic", "holistic-cv")
    assert readers("bev_cell_m") == ("ved", "oft", "bev-lidar")
    assert "bev-lidar" not in readers("image_size")
    assert set(readers("lr")) == set(CATALOGUE)


@pytest.mark.parametrize("system", CATALOGUE)
def test_every_field_states_its_setting_and_has_a_default_of_its_own_type(system):
    cls = CATALOGUE[system].settings
    hints = get_type_hints(cls)
    for name, stated in stated_fields(cls).items():
        assert stated.help.endswith("."), name
        assert stated.group in ("Data", "Model", "Optimisation", "Run")
        default = getattr(cls(), name)
        assert (default is None) <= bool(stated.unset), f"{name}: say what None means"
        assert hints[name]
    assert {field.name for field in fields(cls)} == set(stated_fields(cls))


@pytest.mark.parametrize("system", CATALOGUE)
def test_plain_values_and_back(system):
    settings = CATALOGUE[system].settings(cameras=("CAM_FRONT",), split_ratio=(77, 9), lr=0.5, max_steps=7)
    values = json.loads(json.dumps(settings.to_dict()))
    assert values["system"] == system
    assert settings_from_dict(values) == settings


def test_a_planner_without_past_or_destination_is_called_so():
    assert CATALOGUE["holistic"].settings(no_past=True).label == "holistic-np"
    assert CATALOGUE["lstm-ed"].settings(no_destination=True).label == "lstm-ed-nd"
    both = CATALOGUE["mid-to-end"].settings(no_past=True, no_destination=True)
    assert both.label == "mid-to-end-np-nd"
    assert CATALOGUE["holistic"].settings().label == "holistic"


@pytest.mark.parametrize("system", readers("decoder_width"))
def test_trainings_from_before_decoders_had_a_width_have_the_same_settings(system):
    settings = CATALOGUE[system].settings()
    assert "decoder_width" not in settings.to_dict()

    narrow = CATALOGUE[system].settings(decoder_width=48)
    assert narrow.to_dict() == settings.to_dict() | {"decoder_width": 48}
    assert settings_from_dict(narrow.to_dict()) == narrow


@pytest.mark.parametrize("system", [name for name, entry in CATALOGUE.items() if entry.plans])
def test_trainings_from_before_a_destination_could_be_left_out_have_the_same_settings(system):
    settings = CATALOGUE[system].settings()
    assert "no_destination" not in settings.to_dict()

    without = CATALOGUE[system].settings(no_destination=True)
    assert without.to_dict() == settings.to_dict() | {"no_destination": True}
    assert settings_from_dict(without.to_dict()) == without


def test_predicting_needs_neither_weights_nor_recomputation():
    settings = CATALOGUE["end-to-end"].settings(encoder_weights="imagenet", checkpoint_gradients=True)
    assert settings.for_prediction() == CATALOGUE["end-to-end"].settings()


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"system": "offt"}, "did you mean oft"),
        ({"system": "oft", "epoch": 3}, "did you mean epochs"),
        ({"system": "oft", "epochs": 0}, "epochs: 0 is below 1"),
        ({"system": "oft", "epochs": "many"}, "epochs: 'many' is not a whole number"),
        ({"system": "oft", "lr": -1.0}, "lr: -1.0 is below 0"),
        ({"system": "oft", "lr": float("nan")}, "lr: nan is below 0"),
        ({"system": "oft", "image_size": [16, 800]}, "image_size: 16 is below 32"),
        ({"system": "oft", "split_ratio": [77, 0]}, "split_ratio: 0 is below 1"),
        ({"system": "oft", "flip": 1.5}, "flip: 1.5 is above 1"),
        ({"system": "homography", "head": "six-point"}, "did you mean four-point"),
        ({"system": "oft", "val_split": "train"}, "are both 'train'"),
        ({"system": "holistic", "freeze": ["perception"]}, "freeze: a perception needs weights"),
        ({"system": "holistic", "pool": [100, 55]}, "unknown setting 'pool'; did you mean pool_cells"),
        ({"system": "holistic", "no_past": True, "mean": "linear"}, "mean: linear reads the past"),
        ({"system": "end-to-end", "no_past": True, "mean": "linear"}, "mean: linear reads the past"),
        ({"system": "lstm-ed", "mean": "linaer"}, "did you mean linear"),
        ({"system": "mid-to-end", "pool_cells": 0}, "pool_cells: 0 is below 1"),
        ({"system": "footprints", "kl_weight": 2.0}, "kl_weight: footprints does not read it; ved does"),
        (
            {"system": "lstm-ed", "no_past": True},
            "no_past: lstm-ed does not read it; end-to-end, mid-to-end,",
        ),
        ({}, "system"),
    ],
)
def test_wrong_values_are_named(values, message):
    with pytest.raises(SettingsError, match=message):
        settings_from_dict(values)
