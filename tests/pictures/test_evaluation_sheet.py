"""Pictures of an evaluation: predictions beside the truth."""

import cv2
import numpy as np
import pytest

from ogmkit.errors import OutputError
from ogmkit.evaluation.result import Evaluation, Sample
from ogmkit.pictures.canvas import fit
from ogmkit.pictures.cells import DRIVABLE_COLOUR, GROUND_COLOUR, VEHICLE_COLOUR
from ogmkit.pictures.evaluation_sheet import draw_evaluation, make_folder
from ogmkit.pictures.subjects import CAMERA_SIZE

MARGIN, HEADER, CAPTION, GAP = 40, 104, 44, 12
CAMERA_WIDTH = fit((90, 160), CAMERA_SIZE)[1]


@pytest.fixture
def draw(make_shards, grid, tmp_path):
    """`draw(bev, image, name="ved")` → the picture, (h, w, 3) RGB, of one sample."""
    shards = make_shards()

    def drawn(bev, image=None, name="ved"):
        sample = Sample(name, ("scene-0002", "CAM_FRONT", 1), bev, image)
        evaluation = Evaluation(
            split="val",
            scenes=1,
            frames=3,
            cameras=("CAM_FRONT",),
            grid=grid,
            homography="surface",
            threshold=0.5,
            scale=2.0,
            systems=(name,),
            fixed=(),
            figures=(),
            notes=(),
            samples=(sample,),
        )
        folder = tmp_path / "pictures"
        make_folder(folder, shards)
        (path,) = draw_evaluation(shards, evaluation, folder)
        drawn.path = path
        return cv2.imread(str(path))[..., ::-1]

    drawn.shards = shards
    return drawn


def planes(picture):
    """The four grids: 80 × 40 cells of 0.5 m and 10 m of strip behind, 50 m in 450 pixels."""
    top, height, width = MARGIN + HEADER + CAPTION, 360, 180
    left = MARGIN + CAMERA_WIDTH + GAP
    step = width + GAP
    return [picture[top : top + height, left + place * step :][:, :width] for place in range(4)]


def colour_at(plane, row, column):
    """Of a cell's middle: 4.5 pixels a cell."""
    return tuple(plane[int(4.5 * row + 2), int(4.5 * column + 2)].tolist())


def test_each_target_is_shown_as_predicted_and_as_it_is(draw):
    bev = np.zeros((80, 40), np.uint8)
    bev[:, :5] = 1
    bev[40:50, 30:35] = 2
    drivable, true_drivable, vehicles, true_vehicles = planes(draw(bev))

    # The truth: drivable in columns 10 … 29, a vehicle in rows 20 … 29, columns 4 … 7.
    assert colour_at(drivable, 45, 2) == colour_at(true_drivable, 45, 20) == DRIVABLE_COLOUR
    assert colour_at(drivable, 45, 20) == colour_at(true_drivable, 45, 2) == GROUND_COLOUR
    assert colour_at(vehicles, 45, 32) == colour_at(true_vehicles, 25, 5) == VEHICLE_COLOUR
    assert colour_at(vehicles, 25, 5) == colour_at(true_vehicles, 45, 32) == GROUND_COLOUR
    assert colour_at(drivable, 45, 32) == GROUND_COLOUR  # vehicles have their own plane


def test_what_is_out_of_view_is_shaded(draw):
    bev = np.full((80, 40), 3, np.uint8)
    for plane, colour in zip(planes(draw(bev))[::2], (DRIVABLE_COLOUR, VEHICLE_COLOUR), strict=True):
        assert colour_at(plane, 55, 20) == colour
        assert colour_at(plane, 65, 20) != colour  # the field of view ends at row 60
        assert max(colour_at(plane, 65, 20)) < max(colour)


def test_predicted_masks_lie_on_the_image(draw):
    image = np.zeros((45, 80), np.uint8)
    image[20:30, 40:60] = 2
    photo = draw(np.zeros((80, 40), np.uint8), image)[MARGIN + HEADER + CAPTION :, MARGIN:][
        :450, :CAMERA_WIDTH
    ]
    tinted = (photo[..., 0].astype(int) - photo[..., 2] > 60).nonzero()

    # Ten pixels of the panel for one of the masks.
    assert (tinted[0].min(), tinted[0].max()) == (200, 299)
    assert (tinted[1].min(), tinted[1].max()) == (400, 599)


def test_a_system_without_masks_shows_true_footprints(draw):
    photo = draw(np.zeros((80, 40), np.uint8))[MARGIN + HEADER + CAPTION :, MARGIN:][:450, :CAMERA_WIDTH]
    tinted = (photo[..., 0].astype(int) - photo[..., 2] > 60).nonzero()

    # The car's ground face: x 9.75 … 14.25 m, y 2.05 … 3.95 m, seen from 1.5 m ahead and 1.5 m above.
    left, right = 79.5 - 100 * 3.95 / 8.25, 79.5 - 100 * 2.05 / 12.75
    assert tinted[1].min() == pytest.approx(5 * left, abs=12)  # a sharp corner, few pixels
    assert tinted[1].max() == pytest.approx(5 * right, abs=6)
    assert tinted[0].max() == pytest.approx(5 * (44.5 + 150 / 8.25), abs=6)


def test_a_name_with_a_path_in_it_stays_one_file(draw):
    draw(np.zeros((80, 40), np.uint8), name="runs/a")

    assert draw.path.name == "runs%2Fa.png"


def test_pictures_stay_out_of_the_shards(draw):
    with pytest.raises(OutputError, match="holds nothing but shards"):
        make_folder(draw.shards / "pictures", draw.shards)
