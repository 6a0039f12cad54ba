"""Names of mask sets: the one place that makes and reads them."""

from dataclasses import dataclass
from typing import Literal

from ogmkit.homography.sources import SURFACE, is_source, sources_of

Method = Literal["warp", "project", "full-body"]
"""By a homography; exactly, from the boxes and the ground; or whole bodies, as an ordinary mask has them."""

FULL_BODY: Method = "full-body"

_PROJECTED = "-project"


@dataclass(frozen=True)
class MaskKind:
    """How the masks of a set are made, which is what its default name says.

    Attributes:
        method: how they are made.
        homography: the source that BEV masks are warped with, or one for the drivable area and one for the
            vehicles, such as `surface+plane`. For `project` and `full-body`, the ground that the drivable
            area lies on.
    """

    method: Method
    homography: str = SURFACE

    @property
    def name(self) -> str:
        """The set's default name: `<source>`, `<source>-project` or `full-body`."""
        if self.method == FULL_BODY:
            return FULL_BODY
        return self.homography if self.method == "warp" else f"{self.homography}{_PROJECTED}"


def mask_kind(name: str) -> MaskKind | None:
    """What a default name stands for; None where the name is another one, which the user chose."""
    if name == FULL_BODY:
        return MaskKind(FULL_BODY)
    source = name.removesuffix(_PROJECTED)
    each = sources_of(source)
    if not all(map(is_source, each)) or (source != name and len({*each}) > 1):
        return None
    return MaskKind("warp" if source == name else "project", source)
