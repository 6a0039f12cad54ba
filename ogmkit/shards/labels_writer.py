"""Writing a scene's labels by name, a sample at a time."""

import json
from collections.abc import Sequence

import h5py
import numpy as np

from ogmkit import __version__
from ogmkit.errors import TableError
from ogmkit.frames import KeyFrame, SceneRecord
from ogmkit.labels.definition import Definition
from ogmkit.labels.ignore import has_sweep
from ogmkit.labels.make import labels_of
from ogmkit.nuscenes.expansion import Expansion, open_expansion
from ogmkit.nuscenes.maps import MapMask, MaskStore
from ogmkit.nuscenes.paths import resolve
from ogmkit.shards.fields import FRAMES
from ogmkit.shards.labels_rows import rows_of
from ogmkit.shards.layout import attribute_values, create_dataset, store_dataset
from ogmkit.shards.schema_labels import (
    HAS_SWEEP,
    LABEL_ATTRIBUTES,
    POSES,
    SAMPLE_TOKENS,
    SURROUND,
    label_fields,
    label_group,
    label_sizes,
)
from ogmkit.shards.settings import ExtractSettings
from ogmkit.shards.sink import ShardFile


def write_labels(file: ShardFile, scene: SceneRecord, settings: ExtractSettings, masks: MaskStore) -> None:
    """Write the groups of all definitions but the paper's.

    Args:
        file: the shard, its cameras written.
        scene: with its key frames.
        settings: which definitions, and how they are stored.
        masks: the store of decoded map masks.

    Raises:
        DataFileError: the location's map expansion, or its mask, is absent or damaged.
        TableError: the scene has no key frames.
    """
    for definition in settings.labels:
        rows = rows_of(scene, definition)
        if not rows:
            raise TableError(f"scene {scene.name}: has no key frames; leave it out")
        _write_definition(file, definition, rows, _map_of(rows[0], definition, masks), settings)


def record_text(definition: Definition) -> str:
    """A definition's record as it stands in attributes."""
    return json.dumps(definition.to_dict(), sort_keys=True)


def _map_of(key_frame: KeyFrame, definition: Definition, masks: MaskStore) -> Expansion | MapMask | None:
    if definition.cell.layers == "mask":
        return masks.open(resolve(key_frame.dataroot, key_frame.map_path))
    return open_expansion(key_frame.dataroot, key_frame.location) if definition.needs_map else None


def _write_definition(
    file: ShardFile,
    definition: Definition,
    rows: Sequence[KeyFrame],
    location_map: Expansion | MapMask | None,
    settings: ExtractSettings,
) -> None:
    sizes = {FRAMES: len(rows), **label_sizes(definition.to_dict())}
    with file.writing() as h5:
        group = _new_group(h5, definition, rows)
        rasters = {
            field.name: create_dataset(group, field, sizes, settings.compression)
            for field in label_fields(definition)
            if field.storage == "rasters"
        }
    for row, key_frame in enumerate(rows):
        arrays = labels_of(key_frame, definition, location_map)
        with file.writing():
            for name, array in arrays.items():
                rasters[name].store(row, array)
    if "ignore" in definition.beside:
        swept = np.array([has_sweep(one) for one in rows], dtype=np.bool_)
        with file.writing():
            store_dataset(group, HAS_SWEEP, swept, sizes)


def _new_group(h5: h5py.File, definition: Definition, rows: Sequence[KeyFrame]) -> h5py.Group:
    """The definition's group; what its place holds of it first brings tokens and poses of the samples."""
    place = h5.require_group(definition.place)
    if SAMPLE_TOKENS.name not in place:
        tokens = [one.sample_token for one in rows]
        store_dataset(place, SAMPLE_TOKENS, tokens, {FRAMES: len(rows)})
        for field in POSES if definition.place == SURROUND else ():
            store_dataset(place, field, [getattr(one, field.name) for one in rows], {FRAMES: len(rows)})
    group = h5.create_group(label_group(definition))
    values = {"definition": record_text(definition), "package_version": __version__}
    group.attrs.update(attribute_values(LABEL_ATTRIBUTES, values))
    return group
