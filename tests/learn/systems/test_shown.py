"""What samples.png shows: colours, differences and scores of validation frames."""

from types import SimpleNamespace

import numpy as np
import pytest

torch = pytest.importorskip("torch", reason="torch is not installed: pip install 'ogmkit[train]'")

from ogmkit.drawing.palette import theme  # noqa: E402
from ogmkit.learn.systems.shown import mask_colours, shown_masks, shown_plans  # noqa: E402
from ogmkit.learn.training import watching  # noqa: E402


def colours(pixels):
    return {tuple(colour) for colour in np.unique(pixels.reshape(-1, 3), axis=0).tolist()}


def test_probabilities_are_mixed_from_the_colours_of_every_picture():
    masks = torch.tensor([[0.0, 1.0, 0.5, 1.0], [0.0, 0.0, 0.0, 1.0]]).reshape(1, 2, 1, 4)
    ground, road, between, vehicle = (tuple(one) for one in mask_colours(masks)[0, 0].tolist())

    assert (ground, road, vehicle) == (theme().ground, theme().drivable, theme().vehicle)
    assert between == pytest.approx(np.add(ground, road) / 2, abs=1)


def test_masks_have_their_truth_their_difference_and_their_iou():
    truth, predicted = torch.zeros(2, 2, 40, 40), torch.zeros(2, 2, 40, 40)
    truth[0, 1, :, :20], predicted[0, 1, :, 10:30] = 1, 0.9  # vehicles: 10 columns of 30 in common
    truth[0, 0, :, 30:], predicted[0, 0, :, 30:] = 1, 0.6
    known = torch.ones(2, 40, 40)
    known[1] = 0
    shown = shown_masks(predicted, truth, known)
    panels = dict(shown.panels)

    assert [*panels] == ["predicted", "truth", "difference"]
    assert shown.scores == ("IoU drivable 1.00, vehicles 0.33", "IoU drivable none, vehicles none")
    row = panels["difference"][0, 20]
    assert [tuple(row[column].tolist()) for column in (5, 15, 25, 35)] == [
        *(theme().first, theme().vehicle, theme().second, theme().drivable)
    ]
    assert colours(panels["difference"][1]) == {theme().ground}


def test_a_sheet_of_plans_says_epoch_and_error_and_is_large_enough():
    future = torch.stack([torch.arange(1.0, 7.0) * 4, torch.zeros(6)], 1).repeat(4, 1, 1)
    positions = torch.stack([torch.arange(-5.0, 1.0) * 4, torch.zeros(6)], 1).repeat(4, 1, 1)
    shown = shown_plans(future[:, :5] + torch.tensor([0.0, 2.0]), future, positions)
    ((_, planes),) = shown.panels

    assert shown.scores == ("ADE 2.00 m",) * 4
    assert min(planes.shape[1:3]) >= 300
    assert {theme().second, theme().future, theme().first} <= colours(planes[0])
    headings = []
    whole = watching.draw_sheet
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(watching, "draw_sheet", lambda *given: headings.append(given[0]) or whole(*given))
        system = SimpleNamespace(settings=SimpleNamespace(system="lstm-ed"))
        sheet = watching._draw(system, shown, SimpleNamespace(current_epoch=7, global_step=40))
    assert (headings[0].scene, headings[0].camera) == ("lstm-ed", "epoch 7")
    assert min(sheet.shape[:2]) >= 600


@pytest.mark.parametrize(("points", "labels"), [(5, ["destination", "planned"]), (6, ["planned"])])
def test_a_destination_is_marked_where_it_is_told(points, labels):
    future = torch.stack([torch.arange(1.0, 7.0) * 4, torch.zeros(6)], 1)[None]
    shown = shown_plans(
        future[:, :points] + torch.tensor([0.0, 6.0]), future, future - torch.tensor([28.0, 0.0])
    )
    ((_, planes),) = shown.panels
    heading, entries = shown.groups[-1]

    assert heading == "Plan"
    assert [label for _, label in entries()] == labels
    # 24 m ahead, on 10 px a metre below 450: the diamond is full, the ring of a path is not.
    middle = tuple(planes[0, 209:211, 149:151].reshape(-1, 3).max(axis=0).tolist())
    assert (middle == theme().future) == (points == 5)
