"""Where an extraction's scenes come from: a dataset's tables, or records that were made in Python."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from ogmkit.base.names import unknown
from ogmkit.base.steps import STEP_S
from ogmkit.errors import SettingsError
from ogmkit.frames import FrameRecord, KeyFrame, SceneRecord
from ogmkit.nuscenes.paths import UNSAFE_NAME


class SceneSource(Protocol):
    """What `extract` asks of a dataset; `ogmkit.nuscenes.dataset.Dataset` describes each answer."""

    @property
    def root(self) -> Path:
        """The folder that the records' paths are relative to."""

    @property
    def version(self) -> str:
        """The source's name in manifest and shards."""

    def scene_names(self) -> tuple[str, ...]:
        """Names of all scenes, sorted."""

    def channels(self) -> tuple[str, ...]:
        """Channel names of all cameras, sorted."""

    def categories(self) -> tuple[str, ...]:
        """Names of all object categories, sorted."""

    def scene(
        self,
        name: str,
        cameras: Sequence[str],
        *,
        lidar: str | None = None,
        step_s: float = STEP_S,
        maps: bool = True,
    ) -> SceneRecord:
        """One scene's frames by camera, in temporal order."""

    def key_frames(
        self, name: str, *, lidar: str, camera: str | None = None, maps: bool = False
    ) -> tuple[KeyFrame, ...]:
        """One scene's samples, in temporal order, for labels by name."""

    def frame_tokens(
        self, cameras: Sequence[str], *, lidar: str | None = None, maps: bool = True
    ) -> Mapping[str, Mapping[str, tuple[str, ...]]]:
        """Scene → camera → tokens of its frames; as many scenes as are told of at little cost."""


@dataclass(frozen=True, eq=False)
class RecordDataset:
    """Scenes made in Python, for `extract`: recordings in a layout of their own.

    Attributes:
        root: the folder that the records' paths are relative to.
        version: a name of your choice for manifest and shards.
        scenes: the records.

    Raises:
        SettingsError: no scene is given, two have the same name, or a name can't be a file name.
    """

    root: Path
    version: str
    scenes: tuple[SceneRecord, ...]

    def __post_init__(self) -> None:
        names = self.scene_names()
        if not names or len(set(names)) != len(names):
            raise SettingsError(
                f"{self.root}: scenes {', '.join(names) or 'none'}: give at least one, each once"
            )
        for name in names:
            if re.search(UNSAFE_NAME, name):
                raise SettingsError(f"{self.root}: scene name {name!r} can't be a file's; choose another")

    def scene_names(self) -> tuple[str, ...]:
        """Names of all scenes, sorted."""
        return tuple(sorted(scene.name for scene in self.scenes))

    def channels(self) -> tuple[str, ...]:
        """Channel names of all cameras, sorted."""
        return tuple(sorted({camera for scene in self.scenes for camera in scene.cameras}))

    def categories(self) -> tuple[str, ...]:
        """Names of all boxes' categories, sorted."""
        frames = (frame for scene in self.scenes for frames in scene.cameras.values() for frame in frames)
        return tuple(sorted({category for frame in frames for category in frame.boxes.category}))

    def scene(
        self,
        name: str,
        cameras: Sequence[str],
        *,
        lidar: str | None = None,
        step_s: float = STEP_S,
        maps: bool = True,
    ) -> SceneRecord:
        """One scene with the cameras asked for; sweeps, maps and neighbours are those that the records name.

        Raises:
            SettingsError: the scene is unknown, or lacks a camera.
        """
        del lidar, step_s, maps
        for scene in self.scenes:
            if scene.name == name:
                return SceneRecord(name, scene.location, self._chosen(scene, cameras), log=scene.log)
        raise SettingsError(f"{self.root}: {unknown('scene', name, self.scene_names())}")

    def frame_tokens(
        self, cameras: Sequence[str], *, lidar: str | None = None, maps: bool = True
    ) -> dict[str, dict[str, tuple[str, ...]]]:
        """None: the records are at hand."""
        del cameras, lidar, maps
        return {}

    def key_frames(
        self, name: str, *, lidar: str, camera: str | None = None, maps: bool = False
    ) -> tuple[KeyFrame, ...]:
        """Those of the scene's record.

        Raises:
            SettingsError: the scene is unknown, or its record has none.
        """
        del lidar, camera, maps
        found = next((scene for scene in self.scenes if scene.name == name), None)
        if found is None or not found.key_frames:
            raise SettingsError(
                f"{self.root}: scene {name}: its record has no key frames to make labels from"
            )
        return found.key_frames

    def _chosen(self, scene: SceneRecord, cameras: Sequence[str]) -> dict[str, tuple[FrameRecord, ...]]:
        for camera in cameras:
            if camera not in scene.cameras:
                there = tuple(sorted(scene.cameras))
                raise SettingsError(f"{self.root}: scene {scene.name}: {unknown('camera', camera, there)}")
        return {camera: scene.cameras[camera] for camera in cameras}
