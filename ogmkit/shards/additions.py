"""Adding groups to a shard that exists: whatever happens, it is the old one or the new one."""

import json
import re
from collections.abc import Callable, Collection, Mapping
from pathlib import Path
from typing import Any

import h5py

from ogmkit import __version__
from ogmkit.base.atomic import replacing
from ogmkit.errors import SettingsError, ShardError
from ogmkit.shards.faults import REMEDY, damaged
from ogmkit.shards.fields import AddedKind
from ogmkit.shards.layout import attribute_values
from ogmkit.shards.reader import Shard
from ogmkit.shards.sink import ShardFile, create

_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.+-]{0,99}")  # it becomes part of pictures' file names


def add_to_shard(path: Path, write: Callable[[ShardFile], None], *, replaced: Collection[str] = ()) -> None:
    """Copy a shard, let `write` add to the copy, and put the copy in its place.

    Objects are copied, not bytes: what is replaced leaves no hole, so the new file is the same however
    often something was replaced before.

    Args:
        path: the shard's file.
        write: adds, calling h5py only within `file.writing()`. May read the old shard meanwhile.
        replaced: groups that are not copied, such as `/CAM_FRONT/homography/dlt`.

    Raises:
        OutputError: the disk is full or refuses otherwise.
        ShardError: what is copied, or what `write` reads, is damaged.
    """
    with replacing(path) as part, create(part) as file:
        try:
            with Shard(path) as old, file.writing() as new:
                _copy(old.h5, new, replaced)
            write(file)
        except (OSError, RuntimeError) as error:
            file.check()  # the disk's failure, if it was one: HDF5 itself is told that all went well
            raise damaged(path, error) from error


def new_group(
    h5: h5py.File, camera: str, kind: AddedKind, name: str, values: Mapping[str, Any]
) -> h5py.Group:
    """Make an empty group with its attributes below a camera's.

    Args:
        h5: the file that is written.
        camera: channel.
        kind: what it will hold.
        name: of the new group, such as `surface`.
        values: of its attributes, but for `package_version`; mappings are stored as JSON.
    """
    group = h5.create_group(place(camera, kind, name))
    plain = {key: _json(value) if isinstance(value, Mapping) else value for key, value in values.items()}
    group.attrs.update(attribute_values(kind.attributes, {**plain, "package_version": __version__}))
    return group


def place(camera: str, kind: AddedKind, name: str) -> str:
    """Where an added group stands in the file."""
    return f"/{camera}/{kind.name}/{name}"


def added_values(shard: Shard, camera: str, kind: AddedKind, name: str) -> dict[str, Any] | None:
    """The attributes of an added group, as `new_group` takes them; None where there is no such group.

    Raises:
        ShardError: it lacks one, or one isn't of its kind.
    """
    if name not in shard.added(camera, kind.name):
        return None
    group = place(camera, kind, name)
    there = shard.attributes(group)
    wanted = [attribute for attribute in kind.attributes if attribute.name != "package_version"]
    for one in wanted:
        problem = one.problem(there.get(one.name))
        if problem:
            raise ShardError(f"{shard.path}: {group} attribute {one.name} is {problem}; {REMEDY}")
    values: dict[str, Any] = {one.name: one.kind(there[one.name]) for one in wanted}
    try:
        return values | {"settings": json.loads(values["settings"])}
    except ValueError as error:
        raise ShardError(f"{shard.path}: {group} has damaged settings ({error}); {REMEDY}") from error


def require_name(name: str) -> None:
    """Check the name of a group to be added.

    Raises:
        SettingsError: it would not be one group, or be hard to type.
    """
    if _NAME.fullmatch(name) is None:
        raise SettingsError(
            f"name {name!r}: use letters, digits and _.+- only, a letter or digit first, 100 at most"
        )


def _copy(old: h5py.Group, new: h5py.Group, left_out: Collection[str]) -> None:
    new.attrs.update(old.attrs)
    for name, item in old.items():
        if item.name in left_out:
            continue
        if isinstance(item, h5py.Group):
            if any(inner.name not in left_out for inner in item.values()):  # none is left empty
                _copy(item, new.create_group(name), left_out)
        else:
            old.copy(item, new, name)


def _json(value: Mapping[str, Any]) -> str:
    return json.dumps(value, sort_keys=True)
