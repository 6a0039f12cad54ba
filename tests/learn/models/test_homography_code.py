import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from ogmkit.errors import SettingsError, TrainingError
from ogmkit.grid import GridSpec
from ogmkit.learn.models.four_point_code import FourPointCode
from ogmkit.learn.models.homography_code import EntriesCode
from ogmkit.learn.models.projective import apply, through_four_points

GRID = GridSpec(0.1, 1000, 550, 1000.0, 300.0)
SIZE = (180, 320)
CODES = [EntriesCode, FourPointCode]
VIEWS = (0.0, 55.0)


@pytest.fixture(scope="module")
def sample(make_homography):
    """`sample(seed, count)`: homographies of two cameras whose height and angles wobble, and which camera."""

    def draw(seed, count=24):
        rng = np.random.default_rng(seed)
        camera = np.arange(count) % len(VIEWS)
        matrices = [
            make_homography(
                GRID,
                SIZE,
                height_m=rng.uniform(1.3, 1.9),
                pitch=rng.normal(0.0, 1.5),
                roll=rng.normal(0.0, 1.0),
                yaw=VIEWS[which] + rng.normal(0.0, 0.5),
            )
            for which in camera
        ]
        return torch.from_numpy(np.array(matrices)), torch.from_numpy(camera)

    return draw


@pytest.mark.parametrize("kind", CODES)
@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 2**32 - 1))
def test_homographies_come_back(kind, sample, seed):
    matrices, camera = sample(seed)
    code = kind.fit(matrices, camera, len(VIEWS), SIZE, GRID)
    encoded = code.encode(matrices, camera)
    assert encoded.dtype == torch.float32
    assert encoded.shape == (len(matrices), code.size)
    decoded = code.decode(encoded, camera)
    assert (decoded[:, 2, 2] == -1).all()
    # Relative to what each entry gives at the far corner of the image: a row's terms partly cancel.
    corner = torch.tensor([SIZE[1], SIZE[0], 1.0], dtype=torch.float64)
    size = (matrices * corner).abs().amax(-1, keepdim=True)
    assert ((decoded - matrices) * corner / size).abs().max() < 1e-6


@pytest.mark.parametrize("kind", CODES)
def test_codes_of_the_training_split_are_standard(kind, sample):
    matrices, camera = sample(5, 200)
    encoded = kind.fit(matrices, camera, len(VIEWS), SIZE, GRID).encode(matrices, camera)
    for which in range(len(VIEWS)):
        codes = encoded[camera == which]
        torch.testing.assert_close(codes.mean(0), torch.zeros(codes.shape[1]), atol=1e-4, rtol=0)
        spread = codes.std(0, correction=0)
        assert spread.max() < 1.01
        assert (spread > 0.99).sum() >= 7  # of entries, h33 is constant, and another one almost


@pytest.mark.parametrize("kind", CODES)
def test_what_never_varies_is_not_blown_up(kind, make_homography):
    matrix = torch.from_numpy(make_homography(GRID, SIZE, pitch=1))[None]
    camera = torch.zeros(5, dtype=torch.int64)
    code = kind.fit(matrix.expand(5, 3, 3), camera, 1, SIZE, GRID)
    torch.testing.assert_close(code.encode(matrix, camera[:1]), torch.zeros(1, code.size))
    # A network's answer that is off by a tenth moves the ground 10 m ahead by some centimetres.
    ground = torch.from_numpy(np.array([[300.0, 883.0, 1.0]])) @ torch.linalg.inv(matrix[0]).T
    off = code.decode(torch.full((1, code.size), 0.1), camera[:1])[0] @ ground[0]
    assert (off[:2] / off[2] - torch.tensor([300.0, 883.0])).norm() < 3
    assert (off[:2] / off[2] - torch.tensor([300.0, 883.0])).norm() > 0


def test_entries_are_worked_out_by_hand():
    first = torch.tensor([[-1.0, 2, 30], [0, 4, 50], [0, 0.02, -1]], dtype=torch.float64)
    second = torch.tensor([[-3.0, 2, 10], [0, 8, 50], [0, 0.04, -1]], dtype=torch.float64)
    camera = torch.zeros(2, dtype=torch.int64)
    code = EntriesCode.fit(torch.stack([first, 2 * second]), camera, 1, (100, 200), GRID)
    encoded = code.encode(first[None], camera[:1])[0].reshape(3, 3)
    # Mean −2, deviation 1; constants stay at 0, also the zeros among them.
    torch.testing.assert_close(encoded[0], torch.tensor([1.0, 0.0, 1.0]))
    torch.testing.assert_close(encoded[1], torch.tensor([0.0, -1.0, 0.0]))
    torch.testing.assert_close(encoded[2], torch.tensor([0.0, -1.0, 0.0]))
    # Row 2's largest term at the far corner is 4·100, and 8·100 in the second matrix: 600 on average. So its
    # entry for u counts at least a thousandth of 600/200.
    assert code.scale[0, 1, 0] == pytest.approx(1e-3 * 600 / 200)


def test_four_points_lie_where_the_mean_homography_sees_them(sample):
    matrices, camera = sample(1)
    code = FourPointCode.fit(matrices, camera, len(VIEWS), SIZE, GRID)
    mean = matrices[camera == 1].mean(0)
    pixels, w = apply(torch.linalg.inv(mean)[None], code.places_bev[1])
    assert (w > 0).all()
    expected = torch.tensor([0.15, 0.85, 0.28, 0.72], dtype=torch.float64) * 319
    torch.testing.assert_close(pixels[0, :, 0], expected)
    near, near_too, far, far_too = pixels[0, :, 1].tolist()
    assert near == pytest.approx(near_too)
    assert far == pytest.approx(far_too)
    assert near > far + 10
    seen, _ = apply(torch.linalg.inv(matrices[1:2]), code.places_bev[1])
    offsets = code.encode(matrices[1:2], camera[1:2]).reshape(4, 2) * code.scale_px[1]
    torch.testing.assert_close(code.mean_px[1] + offsets, seen[0], rtol=1e-5, atol=1e-5)


def test_four_points_are_where_homographies_are_steady(make_homography):
    """Fits to ground from 10 m on may do anything nearer by: here they turn about two places 12 m ahead."""
    matrix = torch.from_numpy(make_homography(GRID, SIZE))
    still = torch.tensor(
        [[250.0, 880.0], [350.0, 880.0], [150.0, 500.0], [450.0, 500.0]], dtype=torch.float64
    )
    pixels, _ = apply(torch.linalg.inv(matrix)[None], still)
    moved = pixels.repeat(9, 1, 1)
    moved[:, 2:] += torch.randn(9, 2, 2, dtype=torch.float64) * 0.5
    matrices = through_four_points(moved, still.expand(9, 4, 2))
    code = FourPointCode.fit(matrices, torch.zeros(9, dtype=torch.int64), 1, SIZE, GRID)
    assert code.places_bev[0, :2, 1].max() < 920  # 8 m ahead; 95 % of the height would be 5 m
    assert code.scale_px.max() < 5


def horizon_row(homography):
    """v of the horizon at the image's middle column."""
    return -(homography[2, 0] * 160 + homography[2, 2]) / homography[2, 1]


def test_four_points_go_lower_where_a_frame_sees_no_ground(make_homography):
    high, low = (torch.from_numpy(make_homography(GRID, SIZE, pitch=pitch)) for pitch in (-3.0, -12.0))
    assert 0.72 * 179 < horizon_row(low) < 0.9 * 179
    matrices, camera = torch.stack([high, high, low]), torch.zeros(3, dtype=torch.int64)
    code = FourPointCode.fit(matrices, camera, 1, SIZE, GRID)
    decoded = code.decode(code.encode(matrices, camera), camera)
    torch.testing.assert_close(decoded, matrices, rtol=1e-4, atol=1e-4)


def test_four_points_need_ground_near_the_bottom(make_homography):
    up = torch.from_numpy(make_homography(GRID, SIZE, pitch=-25))[None]
    with pytest.raises(TrainingError, match="regress entries"):
        FourPointCode.fit(up, torch.zeros(1, dtype=torch.int64), 1, SIZE, GRID)


@pytest.mark.parametrize("kind", CODES)
def test_state_dictionaries_restore_a_code(kind, sample):
    matrices, camera = sample(2)
    fitted = kind.fit(matrices, camera, len(VIEWS), SIZE, GRID)
    empty = kind(len(VIEWS), SIZE, GRID)
    assert empty.decode(torch.zeros(1, empty.size), camera[:1]).isnan().all()
    empty.load_state_dict(fitted.state_dict())
    assert torch.equal(empty.encode(matrices, camera), fitted.encode(matrices, camera))


@pytest.mark.parametrize("kind", CODES)
@pytest.mark.parametrize("index", [-1, 2])
def test_unknown_cameras_are_refused(kind, sample, index):
    matrices, camera = sample(3)
    code = kind.fit(matrices, camera, len(VIEWS), SIZE, GRID)
    unknown = torch.tensor([0, index])
    with pytest.raises(SettingsError, match=str(index)):
        code.encode(matrices[:2], unknown)
    with pytest.raises(SettingsError, match=str(index)):
        code.decode(torch.zeros(2, code.size), unknown)


@pytest.mark.parametrize("kind", CODES)
def test_a_camera_without_a_valid_homography_is_refused(kind, sample):
    matrices, camera = sample(4)
    broken = torch.where((camera == 1)[:, None, None], torch.nan, matrices)
    with pytest.raises(TrainingError, match="camera 1"):
        kind.fit(broken, camera, len(VIEWS), SIZE, GRID)


@pytest.mark.parametrize("kind", CODES)
def test_invalid_homographies_do_not_count_and_give_nan(kind, sample):
    matrices, camera = sample(4)
    more = torch.cat([matrices, torch.full((1, 3, 3), torch.nan, dtype=torch.float64)])
    code = kind.fit(more, torch.cat([camera, camera[:1]]), len(VIEWS), SIZE, GRID)
    expected = kind.fit(matrices, camera, len(VIEWS), SIZE, GRID)
    for name, value in code.state_dict().items():
        assert torch.equal(value, expected.state_dict()[name])
    assert code.encode(more[-1:], camera[:1]).isnan().all()


def test_four_points_on_a_line_decode_to_nan(sample):
    matrices, camera = sample(6)
    code = FourPointCode.fit(matrices, camera, len(VIEWS), SIZE, GRID)
    line = torch.tensor([[50.0, 100.0], [90.0, 120.0], [130.0, 140.0], [60.0, 170.0]])
    codes = torch.stack([((line - code.mean_px[0]) / code.scale_px[0]).flatten(), torch.zeros(8)]).float()
    decoded = code.decode(codes, torch.tensor([0, 0]))
    assert decoded[0].isnan().all()
    assert decoded[1].isfinite().all()
