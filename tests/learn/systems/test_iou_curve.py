import numpy as np
import pytest
import torch
from torchmetrics.classification import MultilabelJaccardIndex

from ogmkit.learn.systems.iou_curve import BINS, IouCurve


@pytest.fixture
def batches():
    generator = torch.Generator().manual_seed(3)

    def draw():
        # Hundredths, too: a probability of exactly 0.5 does not exceed a threshold of 0.5.
        probabilities = torch.rand(2, 2, 9, 7, generator=generator)
        probabilities = torch.where(probabilities > 0.6, (probabilities * 100).round() / 100, probabilities)
        truth = (torch.rand(2, 2, 9, 7, generator=generator) < probabilities).float()
        return probabilities, truth, (torch.rand(2, 9, 7, generator=generator) < 0.8).float()

    return [draw() for _ in range(3)]


@pytest.mark.parametrize("step", [1, 37, 50, 80, 99])
def test_every_threshold_is_as_torchmetrics_has_it(batches, step):
    curve = IouCurve(2)
    expected = MultilabelJaccardIndex(2, threshold=step / BINS, average=None, ignore_index=-1)
    for probabilities, truth, known in batches:
        curve.update(probabilities, truth, known)
        labels = torch.where(known[:, None] > 0, truth.long(), -1)
        expected.update(probabilities, labels)
    torch.testing.assert_close(curve.compute()[:, step].float(), expected.compute())


def test_a_curve_by_hand():
    curve = IouCurve(1)
    curve.update(torch.tensor([[[[0.005, 0.295, 0.595, 0.895]]]]), torch.tensor([[[[0.0, 1.0, 0.0, 1.0]]]]))
    found = curve.compute()[0]
    np.testing.assert_allclose(found[[0, 1, 30, 59, 60, 89, 90]], [0.5, 2 / 3, 1 / 3, 1 / 3, 0.5, 0.5, 0])
    curve.reset()
    assert not curve.counts.any()
