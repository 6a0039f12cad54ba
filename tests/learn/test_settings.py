import json

import pytest

from ogmkit.errors import SettingsError
from ogmkit.learn.settings import TrainSettings


@pytest.mark.parametrize(
    ("system", "encoder", "lr", "cell_m"),
    [
        ("homography", "resnet18", 1e-3, None),
        ("footprints", "resnet101", 1e-3, None),
        ("ved", "vgg16_bn", 1e-3, None),
        ("oft", "resnet18", 1e-7, 1.0),
        ("bev-lidar", "resnet101", 1e-3, None),
    ],
)
def test_the_papers_settings_are_the_defaults(system, encoder, lr, cell_m):
    settings = TrainSettings(system)
    assert (settings.encoder, settings.lr, settings.bev_cell_m) == (encoder, lr, cell_m)
    assert (settings.epochs, settings.batch_size, settings.optimizer) == (100, 8, "sgd")
    assert settings.encoder_weights is None


def test_plain_values_and_back():
    settings = TrainSettings("oft", cameras=("CAM_FRONT",), split_ratio=(77, 9), lr=0.5, max_steps=7)
    values = json.loads(json.dumps(settings.to_dict()))
    assert TrainSettings.from_dict(values) == settings


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"system": "offt"}, "did you mean oft"),
        ({"system": "oft", "epoch": 3}, "did you mean epochs"),
        ({"system": "oft", "epochs": 0}, "epochs: 0 is not between 1"),
        ({"system": "oft", "epochs": "many"}, "can't be read"),
        ({"system": "oft", "lr": -1.0}, "learning rate: -1.0"),
        ({"system": "oft", "image_size": [16, 800]}, "image height: 16"),
        ({"system": "oft", "split_ratio": [77, 0]}, "split ratio: 0"),
        ({"system": "oft", "flip": 1.5}, "flip: 1.5"),
        ({"system": "homography", "head": "six-point"}, "did you mean four-point"),
        ({"system": "oft", "val_split": "train"}, "are both 'train'"),
        ({}, "system"),
    ],
)
def test_wrong_values_are_named(values, message):
    with pytest.raises(SettingsError, match=message):
        TrainSettings.from_dict(values)
