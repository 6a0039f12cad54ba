"""Camera images of a scenery: sky, ground, shadows and boxes, with exact geometry.

Boxes projected by the pinhole model lie exactly on the drawn boxes; integer pixels are centres.
"""

import cv2
import numpy as np

from ogmkit.errors import SettingsError
from ogmkit.synthetic.backdrop import draw_backdrop
from ogmkit.synthetic.blending import three_channels
from ogmkit.synthetic.drawing import draw_parts
from ogmkit.synthetic.parts import split_into_parts
from ogmkit.synthetic.scenery import Scenery, Solids
from ogmkit.synthetic.shadows import draw_shadows
from ogmkit.synthetic.view import View
from ogmkit.typing import FloatArray, UInt8Array

_NOISE = 1.3
_JPEG_QUALITY = 90


def render_image(
    scenery: Scenery,
    solids: Solids,
    intrinsics: FloatArray,
    global_from_camera: FloatArray,
    image_size: tuple[int, int],
    *,
    noise_seed: int,
) -> UInt8Array:
    """Draw what a pinhole camera sees.

    Args:
        scenery: ground and light.
        solids: the boxes at this moment.
        intrinsics: (3, 3) without skew.
        global_from_camera: (4, 4); the camera is above the ground and roughly upright.
        image_size: height, width in pixels.
        noise_seed: seed of the sensor's noise, the only randomness.

    Returns:
        (h, w, 3) BGR.

    Raises:
        SettingsError: a size without pixels, or a camera that is not above the ground.
    """
    view = View(intrinsics, global_from_camera, image_size, scenery.height)
    image, inverse_depth = draw_backdrop(scenery, view)
    parts = split_into_parts(solids)
    draw_shadows(image, inverse_depth, parts, view, scenery.palette)
    draw_parts(image, inverse_depth, parts, view, scenery.palette)
    random = np.random.Generator(np.random.PCG64(noise_seed))
    noise = three_channels(np.float32(_NOISE) * random.standard_normal(image_size, dtype=np.float32))
    return np.asarray(cv2.add(image, noise, dtype=cv2.CV_8U), dtype=np.uint8)


def encode_jpeg(image: UInt8Array) -> bytes:
    """Compress a BGR image (h, w, 3).

    Raises:
        SettingsError: OpenCV can't encode it, for instance because it is larger than JPEG allows.
    """
    done, encoded = cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, _JPEG_QUALITY])
    if not done:
        raise SettingsError(
            f"an image of shape {image.shape} can't be stored as JPEG; choose another image size"
        )
    return encoded.tobytes()
