"""Drawing primitives: where they draw, and where not."""

import numpy as np
import pytest

from ogmkit.drawing.canvas import Canvas, fit, resize, shortened, text_width

INK = (255, 255, 255)


def drawn(canvas):
    """Rows and columns that differ from black."""
    rows, columns = np.nonzero(canvas.pixels.any(axis=2))
    return rows, columns


@pytest.mark.parametrize(("align", "left"), [("left", 50), ("centre", 35), ("right", 20)])
def test_text_stands_on_its_baseline_where_it_is_aligned_to(align, left):
    canvas = Canvas(60, 120, (0, 0, 0))
    width = text_width("HHH", 20)
    canvas.text("HHH", 50, 40, 20, INK, align)
    rows, columns = drawn(canvas)

    assert rows.max() == 39
    assert 39 - rows.min() == pytest.approx(0.7 * 20, abs=2)
    expected_left = {"left": 50, "centre": 50 - width // 2, "right": 50 - width}[align]
    assert columns.min() - expected_left in range(4)
    assert expected_left + width - columns.max() in range(5)


def test_text_over_the_border_is_cut_and_outside_draws_nothing():
    canvas = Canvas(20, 20, (0, 0, 0))
    canvas.text("WIDE TEXT", -15, 5, 20, INK)
    assert canvas.pixels.any()

    canvas = Canvas(20, 20, (0, 0, 0))
    for x, baseline in ((500, 10), (-500, 10), (0, 500), (0, -500)):
        canvas.text("text", x, baseline, 20, INK)
    assert not canvas.pixels.any()


def test_a_line_between_pixel_centres_covers_these_pixels():
    canvas = Canvas(9, 20, (0, 0, 0))
    canvas.polyline(np.array([[3.0, 4.0], [15.0, 4.0]]), INK, 1)

    assert (canvas.pixels[4, 4:15] > 200).all()
    assert not canvas.pixels[:, 18:].any()


def test_a_line_to_the_far_distance_keeps_its_direction():
    canvas = Canvas(50, 50, (0, 0, 0))
    canvas.polyline(np.array([[10.0, 25.0], [1e12, 25.0]]), INK, 1)

    assert (canvas.pixels[25, 11:] > 200).all()


def test_dots_are_discs_of_their_radius_round_their_centre():
    canvas = Canvas(41, 41, (0, 0, 0))
    canvas.dots(np.array([[20.0, 15.0]]), INK, 5, rim=(0, 0, 0))
    rows, columns = drawn(canvas)

    assert (rows.mean(), columns.mean()) == pytest.approx((15, 20))
    area = canvas.pixels.sum() / (3 * 255)
    assert np.pi * 5**2 < area < np.pi * 6**2  # OpenCV adds about half a pixel all round


def test_a_transparent_polygon_lets_the_ground_through():
    canvas = Canvas(20, 20, (100, 100, 100))
    canvas.polygon(np.array([[4.0, 4], [15, 4], [15, 15], [4, 15]]), (200, 0, 100), 0.5)

    assert canvas.pixels[10, 10].tolist() == [150, 50, 100]
    assert canvas.pixels[1, 1].tolist() == [100, 100, 100]


def test_a_polygon_clipped_to_nothing_is_no_error():
    canvas = Canvas(5, 5, (0, 0, 0))
    canvas.polygon(np.empty((0, 2)), INK)

    assert not canvas.pixels.any()


def test_fit_keeps_the_shape():
    assert fit((900, 1600), (540, 960)) == (540, 960)
    assert fit((100, 100), (540, 960)) == (540, 540)
    assert fit((1, 10_000), (540, 960)) == (1, 960)


def test_resize_averages_when_it_shrinks_and_keeps_masks_crisp_when_it_grows():
    mask = np.array([[0, 100], [200, 100]], dtype=np.uint8)

    assert resize(mask, (1, 1)).item() == 100
    assert set(np.unique(resize(mask, (8, 8)))) == {0, 100, 200}
    assert len(np.unique(resize(mask, (8, 8), photo=True))) > 3


def test_a_tint_is_as_dense_as_its_shares():
    canvas = Canvas(1, 3, (100, 100, 100))
    canvas.tint(np.array([[0.0, 0.5, 1.0]]), (200, 0, 100), 0.5)

    assert canvas.pixels[0].tolist() == [[100, 100, 100], [125, 75, 100], [150, 50, 100]]


def test_a_long_line_of_text_is_cut_to_its_room():
    assert shortened("short", 20, 200) == "short"
    cut = shortened("a line that is far too long for its room", 20, 200)
    assert cut.endswith("…")
    assert 170 < text_width(cut, 20) <= 200
    assert shortened("nothing fits", 20, 3) == ""
    assert len(shortened("x" * 10**6, 20, 10**9)) == 300


def test_control_characters_are_drawn_as_blanks():
    drawn_text, plain = Canvas(30, 100), Canvas(30, 100)
    drawn_text.text("a\nb\tc", 5, 20, 20)
    plain.text("a b c", 5, 20, 20)

    np.testing.assert_array_equal(drawn_text.pixels, plain.pixels)
