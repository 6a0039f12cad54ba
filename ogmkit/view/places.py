"""Where things stand in a recording's tree."""

from dataclasses import dataclass

from ogmkit.grid import GridSpec


@dataclass(frozen=True)
class Camera:
    """A camera of a scene.

    Attributes:
        scene: its name.
        channel: its name.
        grid: of its rasters.
        rasters: names of its further rasters.
    """

    scene: str
    channel: str
    grid: GridSpec
    rasters: tuple[str, ...]

    def level(self, *parts: str) -> str:
        """A place in the level frame."""
        return entity(self.scene, self.channel, *parts)

    def image(self, *parts: str) -> str:
        """A place in the camera's frame."""
        return self.level("camera", *parts)

    def plane(self, *parts: str) -> str:
        """A place on the grid."""
        return entity(self.scene, "plane", self.channel, *parts)

    @property
    def speed(self) -> str:
        """The place of the speed."""
        return entity(self.scene, "speed", self.channel)


def entity(*parts: str) -> str:
    """A place, whatever characters its parts have."""
    import rerun as rr  # noqa: PLC0415  # comes with the extra `view`

    found: str = rr.new_entity_path([part for name in parts for part in name.split("/")])
    return found
