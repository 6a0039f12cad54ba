import cv2
import numpy as np
import pytest

from ogmkit.errors import DataFileError
from ogmkit.geometry.camera import image_from_resized
from ogmkit.samples.images import decode_resized, resized

SIZE = (96, 160)


def encode(image_rgb, quality=98):
    done, data = cv2.imencode(".jpg", image_rgb[..., ::-1], [cv2.IMWRITE_JPEG_QUALITY, quality])
    assert done
    return data.ravel()


def blob(size, centre_uv, sigma_px):
    v, u = np.indices(size)
    value = 200 * np.exp(-((u - centre_uv[0]) ** 2 + (v - centre_uv[1]) ** 2) / (2 * sigma_px**2))
    return np.repeat(value[..., None], 3, axis=-1).astype(np.uint8)


def test_a_png_gives_its_own_pixels_and_those_of_a_fine_jpeg():
    image = blob(SIZE, (50, 40), 9)
    done, data = cv2.imencode(".png", image[..., ::-1])
    assert done

    assert (decode_resized(data.ravel(), SIZE, SIZE, "frame") == image).all()
    small = decode_resized(data.ravel(), SIZE, (24, 40), "frame").astype(int)
    assert abs(small - decode_resized(encode(image), SIZE, (24, 40), "frame")).max() <= 6


def centre_of_mass(image):
    weights = image.sum(axis=-1, dtype=float)
    weights[weights < 30] = 0  # what the JPEG's ringing adds
    v, u = np.indices(weights.shape)
    return np.array([(u * weights).sum(), (v * weights).sum()]) / weights.sum()


@pytest.mark.parametrize(
    "size", [(96, 160), (48, 80), (24, 40), (12, 20), (40, 100), (23, 37), (96, 40), (120, 200), (192, 80)]
)
def test_geometry_is_kept(size):
    image = decode_resized(encode(blob(SIZE, (61.3, 40.8), 9)), SIZE, size, "here")

    assert image.shape == (*size, 3)
    image_from_own = image_from_resized(SIZE, size)
    u, v, _ = image_from_own @ [*centre_of_mass(image), 1]
    assert (u, v) == pytest.approx((61.3, 40.8), abs=0.3)


@pytest.mark.parametrize(("size", "factor"), [((48, 80), 2), ((24, 40), 4), ((13, 21), 4), ((12, 20), 8)])
def test_a_reduced_decode_is_near_the_full_one(monkeypatch, size, factor):
    smooth = cv2.GaussianBlur(np.random.default_rng(3).uniform(0, 255, (*SIZE, 3)), (0, 0), 6)
    smooth = cv2.normalize(smooth, None, 0, 255, cv2.NORM_MINMAX).astype(np.uint8)
    jpeg = encode(smooth)
    full = cv2.resize(smooth, size[::-1], interpolation=cv2.INTER_AREA)
    flags = []
    decode = cv2.imdecode
    monkeypatch.setattr(cv2, "imdecode", lambda data, flag: flags.append(flag) or decode(data, flag))

    image = decode_resized(jpeg, SIZE, size, "here")

    reduced = getattr(cv2, f"IMREAD_REDUCED_COLOR_{factor}")
    assert flags == [reduced | cv2.IMREAD_IGNORE_ORIENTATION]
    assert np.abs(image.astype(int) - full).mean() < 1.5


@pytest.mark.parametrize(
    ("source_size", "size"),
    [((96, 160), (49, 80)), ((95, 160), (48, 60)), ((96, 160), (40, 81))],
    ids=["too small", "too small by half a pixel", "too narrow"],
)
def test_decoded_in_full_where_reduction_would_not_do(monkeypatch, source_size, size):
    flags = []
    decode = cv2.imdecode
    monkeypatch.setattr(cv2, "imdecode", lambda data, flag: flags.append(flag) or decode(data, flag))

    decode_resized(encode(blob(source_size, (50, 40), 9)), source_size, size, "here")

    assert flags == [cv2.IMREAD_COLOR | cv2.IMREAD_IGNORE_ORIENTATION]


@pytest.mark.parametrize(
    ("source_size", "size"), [((90, 150), (11, 18)), ((90, 151), (22, 37)), ((95, 155), (40, 70))]
)
def test_geometry_is_kept_where_reduction_does_not_divide(source_size, size):
    image = decode_resized(encode(blob(source_size, (90.4, 55.2), 9)), source_size, size, "here")

    assert image.shape == (*size, 3)
    u, v, _ = image_from_resized(source_size, size) @ [*centre_of_mass(image), 1]
    assert (u, v) == pytest.approx((90.4, 55.2), abs=0.3)


def test_areas_of_pixels_that_reach_beyond_the_source_by_hand():
    """20 rows at an eighth are 2.5 pixels; rows of the result take 8 + 2 rows' and 6 + 4 rows' levels."""
    rows = np.repeat(np.array([40, 120, 200], np.uint8), [8, 8, 4])
    image = np.broadcast_to(rows[:, None, None], (20, 16, 3)).copy()

    decoded = decode_resized(encode(image, quality=100), (20, 16), (2, 2), "here")

    by_hand = np.array([56, 152])  # (8 · 40 + 2 · 120) / 10, (6 · 120 + 4 · 200) / 10
    assert np.abs(decoded.astype(int) - by_hand[:, None, None]).max() <= 1


def test_interpolated_where_that_is_the_mean_of_areas():
    noise = np.random.default_rng(4).integers(0, 256, (96, 160, 3), dtype=np.uint8)
    areas = cv2.resize(noise, (160, 95), interpolation=cv2.INTER_AREA)[..., ::-1]

    hardly_smaller = resized(noise, (95, 160))

    assert np.abs(hardly_smaller.astype(int) - areas).max() <= 1 + 255 * (96 / 95 - 1)
    np.testing.assert_array_equal(
        resized(noise, (64, 160)), cv2.resize(noise, (160, 64), interpolation=cv2.INTER_AREA)[..., ::-1]
    )


def test_colours_are_red_green_blue():
    image = np.full((16, 24, 3), (200, 100, 20), np.uint8)

    decoded = decode_resized(encode(image), (16, 24), (8, 12), "here")

    assert np.abs(decoded.astype(int) - (200, 100, 20)).max() <= 3


def test_an_orientation_in_exif_changes_nothing():
    jpeg = encode(blob((16, 24), (6, 5), 3))
    exif = b"Exif\0\0MM\0*\0\0\0\x08\0\x01\x01\x12\0\x03\0\0\0\x01\0\x03\0\0\0\0\0\0"  # turned by 180°
    marker = b"\xff\xe1" + (len(exif) + 2).to_bytes(2, "big") + exif
    turned = np.frombuffer(jpeg.tobytes()[:2] + marker + jpeg.tobytes()[2:], np.uint8)
    assert not np.array_equal(cv2.imdecode(turned, cv2.IMREAD_COLOR), cv2.imdecode(jpeg, cv2.IMREAD_COLOR))

    image = decode_resized(turned, (16, 24), (16, 24), "here")

    np.testing.assert_array_equal(image, decode_resized(jpeg, (16, 24), (16, 24), "here"))


def test_damage_is_named():
    jpeg = encode(blob(SIZE, (50, 40), 9))

    with pytest.raises(DataFileError, match=r"frame 7: image is not a whole \S+ or PNG \(cut short\); rest"):
        decode_resized(jpeg[:-200], SIZE, (48, 80), "frame 7")
    with pytest.raises(DataFileError, match="frame 7: image is not a whole JPEG"):
        decode_resized(np.zeros(100, np.uint8), SIZE, (48, 80), "frame 7")
    with pytest.raises(DataFileError, match="frame 7: image is 160 × 96 pixels, by its record 80 × 96"):
        decode_resized(jpeg, (96, 80), (48, 80), "frame 7")


def test_a_jpeg_of_headers_only_is_damage():
    jpeg = encode(blob(SIZE, (50, 40), 9)).tobytes()
    frame = jpeg.index(b"\xff\xc0")
    length = 2 + int.from_bytes(jpeg[frame + 2 : frame + 4], "big")
    headers = np.frombuffer(jpeg[: frame + length] + b"\xff\xd9", np.uint8)

    with pytest.raises(DataFileError, match="frame 7: image can't be decoded"):
        decode_resized(headers, SIZE, (48, 80), "frame 7")
