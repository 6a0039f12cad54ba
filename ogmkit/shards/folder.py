"""A finished folder of shards, opened by its manifest."""

from pathlib import Path

from ogmkit.base.names import unknown
from ogmkit.errors import SettingsError
from ogmkit.grid import GridSpec
from ogmkit.shards.listed import listed_shard
from ogmkit.shards.manifest import Manifest, ShardEntry, read_manifest
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
        self._entries = {entry.scene: entry for entry in self.manifest.shards}

    @property
    def scenes(self) -> tuple[str, ...]:
        """Names of all scenes, sorted."""
        return tuple(self._entries)

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
        return self.path / self._entry(scene).file

    def shard(self, scene: str) -> Shard:
        """A scene's shard, open: use it in a `with` block.

        Raises:
            SettingsError: the folder has no such scene.
            ShardError: the shard is absent, damaged, of another size than the manifest says, or of another
                format version.
        """
        return listed_shard(self.path, self._entry(scene))

    def _entry(self, scene: str) -> ShardEntry:
        if scene not in self._entries:
            raise SettingsError(f"{self.path}: {unknown('scene', scene, self.scenes)}")
        return self._entries[scene]
