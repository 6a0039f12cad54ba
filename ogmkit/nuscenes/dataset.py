"""A nuScenes-style dataset: scenes as frozen records, checked where they are used (design.md §7)."""

from collections.abc import Iterator, Sequence
from functools import cached_property
from pathlib import Path
from types import TracebackType

from ogmkit.base.names import unknown
from ogmkit.base.steps import STEP_S
from ogmkit.errors import SettingsError, TableError
from ogmkit.frames import KeyFrame, SceneRecord
from ogmkit.nuscenes import splits as split_lists
from ogmkit.nuscenes.array_file import MISSING
from ogmkit.nuscenes.channels import read_channels
from ogmkit.nuscenes.frame_tokens import read_frame_tokens
from ogmkit.nuscenes.overview import SceneOverview, key_files, scene_overviews
from ogmkit.nuscenes.paths import one_line
from ogmkit.nuscenes.places import ScenePlaces, read_places
from ogmkit.nuscenes.records import (
    SceneRows,
    frame_records,
    key_frames,
    lidar_records,
    read_scene_key,
)
from ogmkit.nuscenes.schema import EDGE_TABLES
from ogmkit.nuscenes.soundness import REMEDY, Soundness
from ogmkit.nuscenes.tables import Tables
from ogmkit.nuscenes.uses import prepare
from ogmkit.nuscenes.versions import find_version

_NAME = "coalesce(name, token)"


class Dataset:
    """A dataset folder, opened for reading; use it in a `with` block.

    Tables are loaded once, reduced to what frame records need; scenes are read one at a time. Records can
    be pickled, the dataset itself can't.

    Args:
        root: holds `v1.0-…/`, `samples/` and `maps/`.
        version: the version folder's name; None where there is only one `v1.0-*`.
        memory_limit: DuckDB's cap, such as `1GB`; it spills to a temporary folder beyond.

    Raises:
        TableError: the root or a table is absent, or a table is not JSON array of records.
        SettingsError: the version is absent, or several are there and none was asked for.
    """

    def __init__(self, root: Path, version: str | None = None, *, memory_limit: str = "1GB") -> None:
        self.root = Path(root)
        self.version = find_version(self.root, version)
        self._tables = Tables(self.root / self.version, memory_limit=memory_limit)
        try:
            for table in (one for one in EDGE_TABLES if one != "map"):
                self._tables.load(table)
            no_maps = self._load_or_leave("map")
            no_visibility = self._load_or_leave("visibility")
            if no_visibility is not None and no_visibility.kind != MISSING:
                raise no_visibility  # where it is absent, all are unknown
            prepare(self._tables)
            self._soundness = Soundness(self._tables, no_maps)
        except BaseException:
            self._tables.close()
            raise

    def __enter__(self) -> "Dataset":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Free the tables' memory and temporary files."""
        self._tables.close()

    def scene_names(self) -> tuple[str, ...]:
        """Names of all scenes, sorted; a scene whose name is missing, so that it is unsound, by its token."""
        return self._names(f"SELECT DISTINCT {_NAME} FROM scene WHERE {_NAME} IS NOT NULL ORDER BY 1")

    def channels(self) -> tuple[str, ...]:
        """Channel names of all cameras, sorted."""
        return self._channels("camera")

    def categories(self) -> tuple[str, ...]:
        """Names of all object categories that the dataset lists, sorted."""
        return self._names("SELECT DISTINCT name FROM category WHERE name IS NOT NULL ORDER BY name")

    def overview(self) -> tuple[SceneOverview, ...]:
        """Counts of every scene, sorted by name; looks which images are there."""
        return scene_overviews(self._tables, self.root)

    def key_files(self, channels: Sequence[str], *, maps: bool) -> Iterator[tuple[str, str, str]]:
        """Scene, channel and name of the files of key frames, and of map masks, whose channel is empty."""
        return key_files(self._tables, channels, maps=maps)

    def places(self) -> tuple[ScenePlaces, ...]:
        """Where every scene was recorded, sorted by name; scenes without a pose are not among them."""
        return read_places(self._tables)

    def map_path(self, location: str) -> str:
        """The drivable-area mask of a location, relative to the root.

        Raises:
            SettingsError: no log of the dataset was recorded there, or its map is missing.
        """
        found = self._names(
            "SELECT DISTINCT m.filename FROM map m JOIN log l ON list_contains(m.log_tokens, l.token) "
            "WHERE l.location = ? ORDER BY 1",
            location,
        )
        if not found:
            raise SettingsError(
                unknown(
                    "location", location, self._names("SELECT DISTINCT location FROM log ORDER BY location")
                )
            )
        return found[0]

    def splits(self, split_file: Path | None = None) -> dict[str, tuple[str, ...]]:
        """Split → scene names: of the file given, else of the root's `splits.json`, else the official ones.

        Raises:
            TableError: the split file is absent or malformed, or names a scene that the dataset lacks.
        """
        return split_lists.find_splits(self.root, self.scene_names(), split_file)

    def split(self, name: str, split_file: Path | None = None) -> tuple[str, ...]:
        """The scenes of one split.

        Raises:
            TableError: see `splits`.
            SettingsError: there is no such split, or none of its scenes is here.
        """
        return split_lists.find_split(self.root, self.scene_names(), name, split_file)

    def scene(
        self,
        name: str,
        cameras: Sequence[str],
        *,
        lidar: str | None = None,
        step_s: float = STEP_S,
        maps: bool = True,
    ) -> SceneRecord:
        """One scene's frames by camera, in temporal order.

        Args:
            name: the scene's.
            cameras: channel names.
            lidar: the channel whose sweep of the same sample each frame gets too, such as `LIDAR_TOP`.
            step_s: time from one of a frame's neighbours to the next.
            maps: name each frame's map mask too; False asks nothing of the table of maps.

        Raises:
            SettingsError: the scene, a camera or the LiDAR is unknown.
            TableError: a record that these frames use breaks a rule.
        """
        token = self._token(name)
        for camera in cameras:
            if camera not in self.channels():
                raise SettingsError(f"{self.root}: {unknown('camera', camera, self.channels())}")
        if lidar is not None and lidar not in self._channels("lidar"):
            problem = unknown("LiDAR channel", lidar, self._channels("lidar"))
            raise SettingsError(f"{self.root}: {problem}; choose one with --lidar-channel")
        channels = tuple(cameras) if lidar is None else (*cameras, lidar)
        self._soundness.require((token, name), channels, maps=maps)
        key = read_scene_key(self._tables, self.root, token, name, maps=maps)
        boxes = self._scene_rows.boxes(token)
        sweeps = {} if lidar is None else lidar_records(self._scene_rows.images(token, lidar))
        frames = {}
        for camera in cameras:
            images = self._scene_rows.images(token, camera)
            frames[camera] = frame_records(key, camera, images, boxes, sweeps, step_s)
        return SceneRecord(name=name, location=key.location, cameras=frames, log=key.log)

    def key_frames(
        self, name: str, *, lidar: str, camera: str | None = None, maps: bool = False
    ) -> tuple[KeyFrame, ...]:
        """One scene's samples at the time of their sweeps, in temporal order; no file is looked for.

        Args:
            name: the scene's.
            lidar: the channel whose poses they get, such as `LIDAR_TOP`.
            camera: the channel whose frame each gets too; None for none.
            maps: name each sample's map mask too.

        Raises:
            SettingsError: the scene, the camera or the LiDAR is unknown.
            TableError: a record that these samples use breaks a rule.
        """
        token = self._token(name)
        for kind, channel in (("lidar", lidar), ("camera", camera)):
            if channel is not None and channel not in self._channels(kind):
                raise SettingsError(f"{self.root}: {unknown(kind, channel, self._channels(kind))}")
        self._soundness.require((token, name), (lidar,) if camera is None else (lidar, camera), maps=maps)
        key = read_scene_key(self._tables, self.root, token, name, maps=maps)
        boxes = self._scene_rows.boxes(token)
        by_sample = {}
        if camera is not None:
            images = self._scene_rows.images(token, camera)
            frames = frame_records(key, camera, images, boxes, {}, STEP_S)
            by_sample = {frame.sample_token: frame for frame in frames}
        return key_frames(key, self._scene_rows.images(token, lidar), boxes, by_sample)

    @cached_property
    def _scene_rows(self) -> SceneRows:
        return SceneRows(self._tables)

    def frame_tokens(
        self, cameras: Sequence[str], *, lidar: str | None = None, maps: bool = True
    ) -> dict[str, dict[str, tuple[str, ...]]]:
        """Scene → camera → tokens of its frames, of all scenes that `scene` gives with these arguments."""
        channels = cameras if lidar is None else (*cameras, lidar)
        found = read_frame_tokens(self._tables, self._soundness, channels, maps=maps)
        return {name: {camera: found[name][camera] for camera in cameras} for name in found}

    def _token(self, name: str) -> str:
        found = self._tables.rows(f"SELECT token FROM scene WHERE {_NAME} = ?", [name])
        if not found:
            raise SettingsError(f"{self.root}: {unknown('scene', name, self.scene_names())}")
        token: str | None = found[0][0]
        if token is None:
            raise TableError(f"{self._tables.path('scene')}: scene {one_line(name)} has no token; {REMEDY}")
        return token

    def _channels(self, modality: str) -> tuple[str, ...]:
        return self._channels_of.get(modality, ())

    @cached_property
    def _channels_of(self) -> dict[str, tuple[str, ...]]:
        return read_channels(self._tables)

    def _load_or_leave(self, table: str) -> TableError | None:
        """Load a table, or an empty one in its place where it can't be read: then why."""
        try:
            self._tables.load(table)
        except TableError as error:
            self._tables.load_empty(table)
            return error
        return None

    def _names(self, sql: str, *parameters: str) -> tuple[str, ...]:
        return tuple(row[0] for row in self._tables.rows(sql, parameters))
