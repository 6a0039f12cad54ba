"""Maps decoded before worker processes need them: what is decoded here can be told of."""

from contextlib import suppress
from pathlib import Path

from ogmkit.errors import OgmkitError
from ogmkit.frames import FrameRecord, SceneRecord
from ogmkit.nuscenes.maps import MaskStore
from ogmkit.nuscenes.paths import resolve


class MapsAhead:
    """Decodes each map of the scenes to come once, in this process.

    Args:
        cache_dir: folder of decoded map masks; None means the platform's cache folder.
    """

    def __init__(self, cache_dir: Path | None) -> None:
        self._store = MaskStore(cache_dir)
        self._tried: set[str] = set()

    def lacks(self, scene: SceneRecord) -> bool:
        """Whether the scene's map has not been tried yet."""
        frame = _any_frame(scene)
        return frame is not None and frame.map_path not in self._tried

    def decode(self, scene: SceneRecord) -> None:
        """Decode the scene's map; what is wrong with it is left to the worker, which fails with it too."""
        frame = _any_frame(scene)
        if frame is None or not self.lacks(scene):
            return
        self._tried.add(frame.map_path)
        with suppress(OgmkitError):
            self._store.open(resolve(frame.dataroot, frame.map_path))


def _any_frame(scene: SceneRecord) -> FrameRecord | None:
    return next((frames[0] for frames in scene.cameras.values() if frames), None)
