"""Light, weather and colours of a scene, drawn from a seed."""

from dataclasses import dataclass
from typing import Self

import numpy as np

from ogmkit.typing import FloatArray

# Four kinds of weather: sky overhead and at the horizon (blue, green, red), strength of the sun, haze (m).
_WEATHERS = (
    ((214, 150, 86), (236, 216, 190), 1.0, 900.0),
    ((200, 172, 140), (226, 220, 212), 0.75, 500.0),
    ((176, 166, 158), (212, 208, 204), 0.35, 300.0),
    ((190, 140, 112), (176, 200, 236), 0.9, 600.0),
)


@dataclass(frozen=True)
class Palette:
    """Light, colours and texture of a scene; colours are blue, green, red from 0 to 255.

    Attributes:
        sun_direction: unit vector in `global` that points at the sun.
        sun_strength: share of the light that comes from the sun, 0 to 1; the rest comes from all of the sky.
        sky_zenith_bgr, sky_horizon_bgr: the sky overhead and at the horizon; haze takes the latter.
        haze_m: distance at which about two thirds of a surface's colour is lost.
        asphalt_bgr, walkway_bgr, grass_bgr, marking_bgr: ground colours in full light.
        texture_seed: seed of the ground's grain.
    """

    sun_direction: tuple[float, float, float]
    sun_strength: float
    sky_zenith_bgr: tuple[float, float, float]
    sky_horizon_bgr: tuple[float, float, float]
    haze_m: float
    asphalt_bgr: tuple[float, float, float]
    walkway_bgr: tuple[float, float, float]
    grass_bgr: tuple[float, float, float]
    marking_bgr: tuple[float, float, float]
    texture_seed: int

    @classmethod
    def from_seed(cls, seed: int) -> Self:
        """Draw weather, time of day and ground colours; the same seed gives the same palette."""
        random = np.random.Generator(np.random.PCG64(seed))
        zenith, horizon, sun_strength, haze_m = _WEATHERS[random.integers(len(_WEATHERS))]
        azimuth, elevation = random.uniform(-np.pi, np.pi), np.radians(random.uniform(25, 60))
        asphalt = random.uniform(84, 112) + np.array([3.0, 1.0, 0.0])
        walkway = random.uniform(146, 170) * np.array([0.88, 0.95, 1.0])
        grass = random.uniform(0.85, 1.1) * np.array(
            [62.0, 124 + random.uniform(-10, 10), 98 + random.uniform(-18, 22)]
        )
        return cls(
            sun_direction=(
                float(np.cos(azimuth) * np.cos(elevation)),
                float(np.sin(azimuth) * np.cos(elevation)),
                float(np.sin(elevation)),
            ),
            sun_strength=sun_strength,
            sky_zenith_bgr=zenith,
            sky_horizon_bgr=horizon,
            haze_m=haze_m,
            asphalt_bgr=_colour(asphalt),
            walkway_bgr=_colour(walkway),
            grass_bgr=_colour(grass),
            marking_bgr=(226.0, 232.0, 234.0),
            texture_seed=int(random.integers(2**31)),
        )


def _colour(bgr: FloatArray) -> tuple[float, float, float]:
    blue, green, red = (float(value) for value in bgr)
    return blue, green, red
