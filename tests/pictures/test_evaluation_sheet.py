"""Pictures of an evaluation: predictions beside the truth."""

import cv2
import numpy as np
import pytest

from ogmkit.drawing.bev_panel import plan_for
from ogmkit.drawing.canvas import fit
from ogmkit.drawing.palette import theme
from ogmkit.drawing.sheet import CAPTION, GAP
from ogmkit.errors import OutputError
from ogmkit.evaluation.result import Evaluation, Sample
from ogmkit.grid import GridSpec
from ogmkit.pictures.evaluation_sheet import draw_evaluation, make_folder
from ogmkit.pictures.subjects import PLANE_SIZE, photo_size

GRID = GridSpec(m_per_cell=0.5, rows=80, columns=40, ego_row=80, ego_column=24)
LEFT, TOP = 40, 40 + 104 + 2 * CAPTION
PLAN = plan_for(GRID, (), PLANE_SIZE)
PHOTO = fit((90, 160), photo_size(PLAN))


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
    """Prediction, truth, and both differences."""
    height, width = PLAN.size
    left = LEFT + PHOTO[1] + GAP
    return [picture[TOP : TOP + height, left + place * (width + GAP) :][:, :width] for place in range(4)]


def masked_photo(picture):
    """The lower one of the two pictures."""
    top = TOP + PHOTO[0] + GAP + CAPTION
    return picture[top : top + PHOTO[0], LEFT : LEFT + PHOTO[1]].astype(int)


def colour_at(plane, row, column):
    """Of a cell's middle."""
    per_cell = 0.5 * PLAN.px_per_m
    return tuple(plane[int(per_cell * (row + 0.5)), int(per_cell * (column + 0.5))].tolist())


def colours_near(plane, row, column):
    """Of a cell and those around it, which stripes may run through."""
    return {colour_at(plane, row + i, column + j) for i in range(-4, 5) for j in range(-1, 2)}


def test_prediction_truth_and_differences_stand_side_by_side(draw):
    bev = np.zeros((80, 40), np.uint8)
    bev[:, :3] = 1
    bev[40:50, 30:35] = 2
    predicted, true, drivable, vehicles = planes(draw(bev))

    # The truth: drivable in columns 10 … 29, a vehicle in rows 20 … 29, columns 4 … 7.
    assert colour_at(predicted, 45, 1) == colour_at(true, 45, 20) == theme().drivable
    assert colour_at(predicted, 45, 20) == colour_at(true, 45, 1) == theme().ground
    assert colour_at(predicted, 45, 32) == colour_at(true, 25, 5) == theme().vehicle
    assert colours_near(drivable, 45, 1) == {theme().ground, theme().second}
    assert colours_near(drivable, 45, 20) == {theme().ground, theme().first}
    assert colour_at(drivable, 45, 32) == theme().ground  # vehicles have their own plane
    assert colour_at(vehicles, 45, 32) == theme().second
    assert colour_at(vehicles, 25, 5) == theme().first
    assert colour_at(vehicles, 45, 20) == theme().ground


def test_what_is_out_of_view_is_striped(draw):
    predicted = planes(draw(np.full((80, 40), 1, np.uint8)))[0]

    assert colours_near(predicted, 50, 20) == {theme().drivable}
    assert colours_near(predicted, 70, 20) == {theme().drivable, theme().ground}  # it ends at row 60


def test_predicted_masks_lie_on_the_image(draw):
    image = np.zeros((45, 80), np.uint8)
    image[20:30, 40:60] = 2
    photo = masked_photo(draw(np.zeros((80, 40), np.uint8), image))
    tinted = (photo[..., 0] - photo[..., 2] > 60).nonzero()

    scale = PHOTO[0] / 45
    assert (tinted[0].min(), tinted[0].max()) == pytest.approx((20 * scale, 30 * scale - 1), abs=1)
    assert (tinted[1].min(), tinted[1].max()) == pytest.approx((40 * scale, 60 * scale - 1), abs=1)


def test_a_system_without_masks_shows_true_footprints(draw):
    photo = masked_photo(draw(np.zeros((80, 40), np.uint8)))
    tinted = (photo[..., 0] - photo[..., 2] > 60).nonzero()
    scale = PHOTO[0] / 90

    # The car's ground face: x 9.75 … 14.25 m, y 2.05 … 3.95 m, seen from 1.5 m ahead and 1.5 m above.
    left, right = 79.5 - 100 * 3.95 / 8.25, 79.5 - 100 * 2.05 / 12.75
    assert tinted[1].min() == pytest.approx(scale * left, abs=10)  # a sharp corner, few pixels
    assert tinted[1].max() == pytest.approx(scale * right, abs=5)
    assert tinted[0].max() == pytest.approx(scale * (44.5 + 150 / 8.25), abs=5)


def test_a_name_with_a_path_in_it_stays_one_file(draw):
    draw(np.zeros((80, 40), np.uint8), name="runs/a")

    assert draw.path.name == "runs%2Fa.png"


def test_pictures_stay_out_of_the_shards(draw):
    with pytest.raises(OutputError, match="holds nothing but shards"):
        make_folder(draw.shards / "pictures", draw.shards)
