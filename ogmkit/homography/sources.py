"""Names of the sources that homographies come from: the methods of `homography-fit`, and networks."""

import re
from collections.abc import Collection

SURFACE, NETWORK = "surface", "network"
CALIBRATION, EGO_PLANE = "calibration", "ego-plane"
METHOD_NAMES = (SURFACE, "dlt", "robust", "plane", "four-point", CALIBRATION, EGO_PLANE)
"""Of `homography-fit`, the default first; `ogmkit.homography.methods` has their estimators."""

_NETWORK_NAME = re.compile(rf"{NETWORK}(-.+)?")


def is_network(source: str) -> bool:
    """Whether a source is a network: `network` or `network-…`."""
    return _NETWORK_NAME.fullmatch(source) is not None


def is_source(name: str) -> bool:
    """Whether the name is that of a method or of a network."""
    return name in METHOD_NAMES or is_network(name)


def sources_of(homography: str) -> tuple[str, str]:
    """The sources of drivable area and vehicles: `surface` is one for both, `surface+plane` one for each."""
    drivable, _, vehicles = homography.partition("+")
    if is_source(drivable) and is_source(vehicles):
        return drivable, vehicles
    return homography, homography


def preferred_source(available: Collection[str]) -> str | None:
    """What masks are warped with unless told otherwise: `network`, as in the paper, else `surface`.

    Returns:
        None where neither is available.
    """
    return next((source for source in (NETWORK, SURFACE) if source in available), None)
