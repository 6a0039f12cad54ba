"""Whether what reads and writes files works: a few pixels there and back."""

import io
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType

import cv2
import h5py
import numpy as np
from PIL import Image, features

from ogmkit.typing import UInt8Array

_SIDE = 64
_JPEG_ERROR = 8


@dataclass(frozen=True)
class Decoder:
    """A way to read pixels.

    Attributes:
        name: what it reads.
        library: what does it, with its release.
        problem: why it doesn't work; empty where it does.
    """

    name: str
    library: str
    problem: str


def decoders() -> tuple[Decoder, ...]:
    """Try each."""
    pillow = f"Pillow, libjpeg-turbo {features.version('libjpeg_turbo') or 'absent'}"
    opencv, hdf5 = f"OpenCV {cv2.__version__}", f"HDF5 {h5py.version.hdf5_version}"
    libraries = {"OpenCV": opencv, "Pillow": pillow, "HDF5": hdf5}
    return tuple(
        Decoder(name, libraries[library], _problem(trial)) for (name, library), trial in _TRIALS.items()
    )


def _problem(trial: Callable[[UInt8Array], bool]) -> str:
    ramp = np.arange(_SIDE, dtype=np.uint8) * 3
    pixels = np.broadcast_to(ramp[:, None, None], (_SIDE, _SIDE, 3)).copy()
    try:
        return "" if trial(pixels) else "gives other pixels than it was given"
    except Exception as error:  # whatever a broken library raises is what is asked for
        return f"{type(error).__name__}: {error}"


def _jpeg(pixels: UInt8Array, flag: int, factor: int) -> bool:
    _, data = cv2.imencode(".jpg", pixels)
    found = cv2.imdecode(data, flag)
    return found is not None and _near(np.asarray(found, np.uint8), pixels[::factor, ::factor], 3 * factor)


def _png(pixels: UInt8Array) -> bool:
    _, data = cv2.imencode(".png", pixels)
    found = cv2.imdecode(data, cv2.IMREAD_COLOR)
    return found is not None and bool(np.array_equal(found, pixels))


def _pillow_jpeg(pixels: UInt8Array) -> bool:
    data = io.BytesIO()
    Image.fromarray(pixels).save(data, "JPEG")
    return _near(np.asarray(Image.open(data).convert("RGB")), pixels, 0)


def _hdf5(pixels: UInt8Array, compression: str) -> bool:
    with h5py.File("doctor.h5", "w", driver="core", backing_store=False) as file:
        held = file.create_dataset("pixels", data=pixels, compression=compression, chunks=(8, _SIDE, 3))
        return bool(np.array_equal(held[:], pixels))


def _near(found: UInt8Array, expected: UInt8Array, more: int) -> bool:
    if found.shape != expected.shape:
        return False
    return bool(np.abs(found.astype(int) - expected).max() <= _JPEG_ERROR + more)


_TRIALS: Mapping[tuple[str, str], Callable[[UInt8Array], bool]] = MappingProxyType(
    {
        ("JPEG", "OpenCV"): lambda pixels: _jpeg(pixels, cv2.IMREAD_COLOR, 1),
        ("JPEG at an eighth", "OpenCV"): lambda pixels: _jpeg(pixels, cv2.IMREAD_REDUCED_COLOR_8, 8),
        ("PNG", "OpenCV"): _png,
        ("JPEG", "Pillow"): _pillow_jpeg,
        ("shards, gzip", "HDF5"): lambda pixels: _hdf5(pixels, "gzip"),
        ("shards, lzf", "HDF5"): lambda pixels: _hdf5(pixels, "lzf"),
    }
)
