"""Labels of different definitions side by side, over the key frames of a dataset."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations
from operator import itemgetter

import numpy as np

from ogmkit.errors import SettingsError
from ogmkit.frames import KeyFrame
from ogmkit.labels.compare import (
    RANGES,
    SHIFTS,
    counts_by_range,
    counts_by_shift,
    masks_of,
    range_masks,
    same_cells,
)
from ogmkit.labels.definition import Definition
from ogmkit.labels.exact import EXACT, exact_of
from ogmkit.labels.make import labels_of
from ogmkit.nuscenes.dataset import Dataset
from ogmkit.nuscenes.expansion import open_expansion
from ogmkit.typing import BoolArray, IntArray

Pair = tuple[Definition, Definition]
Masks = dict[str, BoolArray]


@dataclass(frozen=True)
class LabelRow:
    """Two labels of one class.

    Attributes:
        one: a definition's name.
        other: another's, or `exact`: the centre-inside raster of the same frame, grid, classes and filters.
        label: the class; `visibility` is all boxes that the array of that name shows.
        range: of cells, by their distance.
        cells: of one.
        other_cells: of the other.
        iou: of both as they lie; NaN where neither has any.
        area_ratio: cells / other_cells; NaN without any of the other's.
        shift: rows and columns that one's cells lie farther along the coordinates than the other's, where
            both fit best.
        shifted_iou: with that taken out, over the cells that both then have.
    """

    one: str
    other: str
    label: str
    range: str
    cells: int
    other_cells: int
    iou: float
    area_ratio: float
    shift: tuple[int, int]
    shifted_iou: float


@dataclass(frozen=True)
class LabelComparison:
    """What was found over all frames.

    Attributes:
        frames: key frames.
        rows: of each pair of definitions whose cells can be compared, by class and range.
        worst: (scene, place of its key frame) where the first pair differs in most cells.
        apart: pairs of names whose arrays have no cells in common, so that they stand in no row.
    """

    frames: int
    rows: tuple[LabelRow, ...]
    worst: tuple[str, int]
    apart: tuple[tuple[str, str], ...]


class _Tally:
    """Counts of one pair's classes, added up over frames."""

    def __init__(self, pair: Pair) -> None:
        self.pair = pair
        self._ranges = range_masks(pair[0])
        self._by_range: dict[str, IntArray] = {}
        self._by_shift: dict[str, IntArray] = {}

    def add(self, one: Masks, other: Masks) -> int:
        """Count one frame; returns the cells that differ."""
        different = 0
        for label in (label for label in one if label in other):
            ranged = counts_by_range(one[label], other[label], self._ranges)
            shifted = counts_by_shift(one[label], other[label])
            self._by_range[label] = self._by_range.get(label, 0) + ranged
            self._by_shift[label] = self._by_shift.get(label, 0) + shifted
            different += int(ranged[0, 0] + ranged[0, 1] - 2 * ranged[0, 2])
        return different

    def rows(self) -> Iterator[LabelRow]:
        """A row for each class and range."""
        names = self.pair[0].name, self.pair[1].name
        for label, counts in self._by_range.items():
            shares = [_share(both, either) for both, either in self._by_shift[label].tolist()]
            best = int(np.nanargmax(shares)) if not np.isnan(shares).all() else SHIFTS.index((0, 0))
            for name, (one, other, both) in zip(RANGES, counts.tolist(), strict=True):
                iou, ratio = _share(both, one + other - both), _share(one, other)
                yield LabelRow(*names, label, name, one, other, iou, ratio, SHIFTS[best], shares[best])


def compare_labels(
    dataset: Dataset,
    scenes: Sequence[str],
    definitions: Sequence[Definition],
    *,
    lidar: str = "LIDAR_TOP",
    camera: str = "CAM_FRONT",
    on_progress: Callable[[int, int], None] | None = None,
) -> LabelComparison:
    """Compare definitions with each other, and each with its exact raster.

    Args:
        dataset: the dataset; no camera's file is read.
        scenes: names.
        definitions: at least one, each once.
        lidar: channel of the LiDAR whose poses frames hang on.
        camera: channel of the front camera, for labels that lie before it.
        on_progress: called with (scenes done, scenes in all).

    Raises:
        SettingsError: no definition, one named twice, or one without any class.
        DataFileError: a location's map expansion is absent or damaged.
    """
    _require(definitions)
    pairs = [(one, exact_of(one)) for one in definitions]
    pairs += [pair for pair in combinations(definitions, 2) if same_cells(*pair)]
    tallies, frames, worst = [_Tally(pair) for pair in pairs], 0, (-1, "", 0)
    for done, scene in enumerate(scenes, start=1):
        for place, key_frame in enumerate(dataset.key_frames(scene, lidar=lidar, camera=camera)):
            masks = frame_masks(key_frame, definitions)
            found = [tally.add(*_of_pair(masks, tally.pair)) for tally in tallies]
            worst, frames = max(worst, (found[0], scene, place), key=itemgetter(0)), frames + 1
        if on_progress is not None:
            on_progress(done, len(scenes))
    rows = tuple(row for tally in tallies for row in tally.rows())
    return LabelComparison(frames, rows, worst[1:], _apart(definitions))


def frame_masks(key_frame: KeyFrame, definitions: Sequence[Definition]) -> dict[tuple[str, bool], Masks]:
    """(Definition's name, whether the exact raster) → masks of a key frame."""
    masks = {}
    for definition in definitions:
        for exact in (False, True):
            drawn = exact_of(definition) if exact else definition
            needs = definition.needs_map
            expansion = open_expansion(key_frame.dataroot, key_frame.location) if needs else None
            masks[definition.name, exact] = masks_of(labels_of(key_frame, drawn, expansion), drawn)
    return masks


def _of_pair(masks: dict[tuple[str, bool], Masks], pair: Pair) -> tuple[Masks, Masks]:
    one, other = pair
    exact = other.name == EXACT
    return masks[one.name, False], masks[one.name if exact else other.name, exact]


def _apart(definitions: Sequence[Definition]) -> tuple[tuple[str, str], ...]:
    pairs = (pair for pair in combinations(definitions, 2) if not same_cells(*pair))
    return tuple((one.name, other.name) for one, other in pairs)


def _require(definitions: Sequence[Definition]) -> None:
    names = [one.name for one in definitions]
    if not names or len(set(names)) != len(names):
        raise SettingsError(f"definitions: {', '.join(names) or 'none'}: name at least one, each once")
    for definition in definitions:
        if not definition.classes:
            raise SettingsError(f"definition {definition.name}: has no class without a map; leave it out")


def _share(part: int, whole: int) -> float:
    return part / whole if whole else float("nan")
