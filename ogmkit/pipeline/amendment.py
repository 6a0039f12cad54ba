"""What a command adds to shards, and whether a folder is fit for it."""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Protocol, TypeVar

from ogmkit.base.differences import differences
from ogmkit.base.names import unknown
from ogmkit.errors import OutputError, SettingsError, ShardError
from ogmkit.labels.names import PAPER
from ogmkit.shards.additions import added_values
from ogmkit.shards.faults import AGAIN, REMEDY
from ogmkit.shards.fields import AddedKind
from ogmkit.shards.manifest import Manifest, ShardEntry
from ogmkit.shards.reader import Shard
from ogmkit.shards.sink import ShardFile
from ogmkit.shards.structure import structure_problems

Report_co = TypeVar("Report_co", covariant=True)

Groups = Mapping[str, Mapping[str, Any]]
"""Name of each added group → its attributes, as `additions.new_group` takes them: `settings` is a mapping."""


class Amendment(Protocol[Report_co]):
    """What a command adds to the cameras of shards: a frozen dataclass of picklable values."""

    @property
    def command(self) -> str:
        """The command as the user calls it, such as `homography-fit`."""

    @property
    def kind(self) -> AddedKind:
        """What the groups are: one of `schema.ADDED`."""

    def groups(self, shard: Shard, camera: str) -> Groups:
        """The groups that the camera shall have; existing ones with the same attributes are kept.

        Asked of all shards before the first one is changed.

        Raises:
            ShardError: the shard lacks what they are made from.
            SettingsError: they can't be made from it.
        """

    def write(self, shard: Shard, camera: str, names: Sequence[str], file: ShardFile) -> None:
        """Write the datasets of some of the groups; they are there, empty, with their attributes.

        Runs in a worker.

        Args:
            shard: the old shard, to read from.
            camera: channel.
            names: of the groups to fill: `h5[f"{camera}/{kind.name}/{name}"]` of `file.writing() as h5`.
            file: the new shard.
        """

    def report(self, shard: Shard, cameras: Sequence[str]) -> Report_co:
        """What the command wants to know of a shard that has all the groups; runs in a worker."""


def chosen_cameras(out: Path, manifest: Manifest, cameras: Sequence[str]) -> tuple[str, ...]:
    """The cameras that a command works on; all of the folder's where none is named.

    Raises:
        SettingsError: the shards have no such camera, or no camera's frames at all.
    """
    known = tuple(sorted(manifest.settings.cameras))
    if not known:
        raise SettingsError(f"{out}: holds labels alone; extract with --definition {PAPER} as well")
    for camera in cameras:
        if camera not in known:
            raise SettingsError(f"{out}: {unknown('camera', camera, known)}")
    return tuple(dict.fromkeys(cameras)) or known


def require_sound(shard: Shard, entry: ShardEntry, manifest: Manifest) -> None:
    """Refuse to build on a shard that isn't what the manifest and the schema say; reads no data.

    Args:
        shard: the shard.
        entry: the manifest's.
        manifest: the folder's.

    Raises:
        ShardError: it isn't; names the first difference.
    """
    for problem in structure_problems(shard):
        raise ShardError(f"{shard.path}: {problem}; {REMEDY}")
    there = {"scene": entry.scene, **manifest.settings.to_dict()}
    different = differences({"scene": shard.scene, **shard.settings.to_dict()}, there)
    if different:
        raise ShardError(f"{shard.path}: contradicts the manifest: {different[0]}; {AGAIN}")


def pending_groups(
    shard: Shard, amendment: Amendment[object], cameras: Sequence[str], *, overwrite: bool
) -> dict[str, Groups]:
    """Camera → the groups that are to be made; cameras that have all of them are left out.

    Args:
        shard: the shard.
        amendment: what is added.
        cameras: channels.
        overwrite: also rebuild existing ones.

    Raises:
        OutputError: one exists with other attributes, and `overwrite` is false.
        ShardError, SettingsError: as `Amendment.groups`.
    """
    pending: dict[str, Groups] = {}
    for camera in cameras:
        missing = {}
        for name, values in amendment.groups(shard, camera).items():
            there = added_values(shard, camera, amendment.kind, name)
            if there is None or overwrite:
                missing[name] = values
                continue
            different = differences(_as_stored(values), there)
            if different:
                raise OutputError(
                    f"{shard.path}: {camera}/{amendment.kind.name}/{name} exists with other settings: "
                    f"{', '.join(different)}; use --overwrite"
                )
        if missing:
            pending[camera] = missing
    return pending


def _as_stored(values: Mapping[str, Any]) -> dict[str, Any]:
    """Tuples become lists, as in what is read back."""
    stored: dict[str, Any] = json.loads(json.dumps(values))
    return stored
