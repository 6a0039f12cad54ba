"""What a training says in advance: that it will take days, how long it takes, what it computes with."""

import pytest
import torch

from ogmkit.base.news import Found, listening
from ogmkit.learn.catalogue import CATALOGUE
from ogmkit.learn.devices import arithmetic
from ogmkit.learn.training.found import slow_warning


@pytest.fixture
def on_cpu(monkeypatch):
    monkeypatch.setattr(torch.cuda, "is_available", lambda: False)


def test_the_paper_s_settings_without_a_gpu_are_warned_of(on_cpu):
    settings = CATALOGUE["footprints"].settings
    warning = slow_warning(settings(), 2424)
    assert warning.startswith(
        "no GPU was found: 100 passes over 2,424 samples of images of 448x800 take days"
    )
    assert slow_warning(settings(max_steps=10), 2424) is None
    assert slow_warning(settings(image_size=(96, 160)), 2424) is None
    assert slow_warning(CATALOGUE["lstm-ed"].settings(), 2424) is None


def test_a_gpu_is_not_warned_of(monkeypatch):
    monkeypatch.setattr(torch.cuda, "is_available", lambda: True)
    assert slow_warning(CATALOGUE["footprints"].settings(), 2424) is None


@pytest.mark.parametrize(
    ("capability", "expected"),
    [("avx512_bf16", "bf16-mixed"), ("amx_bf16", "bf16-mixed"), ("avx512_f", "32-true")],
)
def test_automatic_precision_is_what_the_processor_has(on_cpu, monkeypatch, capability, expected):
    monkeypatch.setattr(torch.cpu, "get_capabilities", lambda: {capability: True}, raising=False)
    assert arithmetic("auto") == expected
    assert arithmetic("16-mixed") == "16-mixed"


def test_after_some_steps_the_time_is_told(plan_shards, tmp_path):
    from ogmkit.learn.training.train import train

    settings = CATALOGUE["lstm-ed"].settings(epochs=20, batch_size=1, hidden=4)
    heard = []
    with listening(heard.append):
        train(settings, plan_shards, tmp_path / "run")
    (told,) = [news.text for news in heard if isinstance(news, Found) and "are left" in news.text]
    assert told.startswith("70 steps of ")
    assert told.endswith(" s, and the validations")
