"""Whether labels by name agree with themselves and with the cameras' frames."""

from collections.abc import Iterator

import numpy as np

from ogmkit.labels.definition import Definition
from ogmkit.labels.make import NO_VISIBILITY
from ogmkit.shards.crosschecks import first_wrong, rigid
from ogmkit.shards.labels_stored import holds_labels_only
from ogmkit.shards.reader import Shard
from ogmkit.shards.schema_labels import LABELS, POSES, SAMPLE_TOKENS, SURROUND
from ogmkit.typing import BoolArray, UInt8Array


def label_contradictions(shard: Shard) -> Iterator[str]:
    """Describe what contradicts itself in a shard's labels, whose structure is sound.

    Arrays are read frame by frame.

    Yields:
        A line for each contradiction, naming the dataset and the first frame.
    """
    places = [name for name in sorted(shard.h5) if holds_labels_only(shard.h5[name])]
    for place in places:
        tokens = shard.strings(place, SAMPLE_TOKENS.name)
        if len(set(tokens)) != len(tokens):
            yield f"/{place}/{SAMPLE_TOKENS.name} has duplicates"
        for field in POSES if place == SURROUND else ():
            if field.name in shard.h5[place]:
                wrong = ~rigid(shard.dataset(place, field.name)[:])
                yield from first_wrong(f"/{place}/{field.name} is not a rigid transform in", wrong)
        for camera in shard.cameras:
            if not set(shard.strings(camera, SAMPLE_TOKENS.name)) <= set(tokens):
                yield f"/{place}/{SAMPLE_TOKENS.name} lacks samples of /{camera}"
    for definition in shard.settings.labels:
        yield from _contradictions(shard, definition)


def _contradictions(shard: Shard, definition: Definition) -> Iterator[str]:
    group = f"{LABELS}/{definition.name}"
    frames = shard.frames(definition.place)
    wrong = {name: np.zeros(frames, dtype=np.bool_) for name in definition.arrays}
    for frame in range(frames):
        arrays = {
            name: shard.dataset(definition.place, f"{group}/{name}")[frame] for name in definition.arrays
        }
        for name, array in arrays.items():
            wrong[name][frame] = not _sound(name, array, arrays, definition)
    for name, frames_wrong in wrong.items():
        place = f"/{definition.place}/{group}/{name}"
        yield from first_wrong(f"{place} contradicts its definition in", frames_wrong)


def _sound(name: str, array: UInt8Array, arrays: dict[str, UInt8Array], definition: Definition) -> bool:
    """Whether an array has values that its name allows, and agrees with those beside it."""
    if name == "instance":
        return True
    if name == "visibility":
        return bool(np.isin(array, [0, 1, 2, 3, 4, NO_VISIBILITY]).all())
    same: BoolArray | bool = True
    if name == "valid":
        same = array == (arrays["visibility"] >= 2)
    for one in definition.classes:
        if one.name == name and one.unites:
            same = array == np.maximum.reduce([arrays[part] for part in one.unites])
    return bool(np.all(same)) and int(array.max(initial=0)) <= 1
