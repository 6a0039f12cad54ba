"""A finished folder of shards, opened by its manifest."""

from pathlib import Path

from ogmkit.base.names import unknown
from ogmkit.errors import SettingsError
from ogmkit.grid import GridSpec
from ogmkit.shards.manifest import Manifest, read_manifest
from ogmkit.shards.reader import Shard


class ShardFolder:
    """A folder that `extract` finished; only its manifest is read.

    Args:
        path: the folder.

    Attributes:
        path: the folder.
        manifest: what is there, with settings, splits and checksums.

    Raises:
        ShardError: the manifest is absent, damaged, or of another format version.
    """

    def __init__(self, path: Path) -> None:
        self.path = Path(path)
        self.manifest: Manifest = read_manifest(self.path)
        self._files = {entry.scene: entry.file for entry in self.manifest.shards}

    @property
    def scenes(self) -> tuple[str, ...]:
        """Names of all scenes, sorted."""
        return tuple(self._files)

    @property
    def cameras(self) -> tuple[str, ...]:
        """Channels of all shards, sorted."""
        return tuple(sorted(self.manifest.settings.cameras))

    @property
    def grid(self) -> GridSpec:
        """The grid of all rasters."""
        return self.manifest.settings.targets.grid

    def file(self, scene: str) -> Path:
        """A scene's shard.

        Raises:
            SettingsError: the folder has no such scene.
        """
        if scene not in self._files:
            raise SettingsError(f"{self.path}: {unknown('scene', scene, self.scenes)}")
        return self.path / self._files[scene]

    def shard(self, scene: str) -> Shard:
        """A scene's shard, open: use it in a `with` block.

        Raises:
            SettingsError: the folder has no such scene.
            ShardError: the shard is absent, damaged, or of another format version.
        """
        return Shard(self.file(scene))
