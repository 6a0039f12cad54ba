"""Planning scores by the names of their definitions: the field's, and exact ones."""

from collections.abc import Iterator, Mapping

import numpy as np

from ogmkit.evaluation.planning.fixed import TRUTH
from ogmkit.evaluation.planning.obstacles import CameraObstacles
from ogmkit.evaluation.planning.result import PlanFigure
from ogmkit.evaluation.planning.sequences import Sequences
from ogmkit.evaluation.progress import Tick
from ogmkit.metrics.bootstrap import estimate
from ogmkit.metrics.displacement import means_of
from ogmkit.metrics.open_loop.catalogue import DEFINITIONS
from ogmkit.metrics.open_loop.horizons import HORIZON_POINTS, POINTS, at_horizons, horizons_s
from ogmkit.metrics.open_loop.scores import Surrounding, metrics_of, point_values
from ogmkit.typing import BoolArray, FloatArray, IntArray

COLUMNS = tuple((name, metric) for name, one in DEFINITIONS.items() for metric in metrics_of(one))
"""Definition and metric of all figures."""


def named_figures(sequences: Sequences, rows: Mapping[str, FloatArray], tick: Tick) -> Iterator[PlanFigure]:
    """All figures of some rows, by each definition.

    Args:
        sequences: N of them.
        rows: name → (N, T, 2) positions at points 1 … T, metres, T at most 6: figures that need a further
            point are NaN. What was driven, `TRUTH`, has its own headings; those of plans follow their paths.
        tick: called after every sequence.

    Raises:
        ShardError: a shard is damaged, or a box has no finite pose or size.
    """
    points = np.stack([_six(plans) for plans in rows.values()])
    values = _values(sequences, points, np.array([name == TRUTH for name in rows]), tick)
    found = estimate(_scene_sums(values, sequences.scene, sequences.scenes), means_of)
    horizons = horizons_s(sequences.index.step_s)
    for place in np.ndindex(found.value.shape):
        row, column, horizon = place
        name, metric = COLUMNS[column]
        figures = (float(one[place]) for one in (found.value, found.low, found.high))
        reading = DEFINITIONS[name].reading
        yield PlanFigure(tuple(rows)[row], metric, horizons[horizon], reading, *figures, definition=name)


def _six(plans: FloatArray) -> FloatArray:
    """(N, 6, 2), NaN where there is no point."""
    filled = np.full((len(plans), POINTS, 2), np.nan)
    filled[:, : plans.shape[1]] = plans
    return filled


def _values(sequences: Sequences, points: FloatArray, driven: BoolArray, tick: Tick) -> FloatArray:
    """(R, columns, N, 3) values at the horizons of (R, N, 6, 2) points; (R,) which of them were driven."""
    index = sequences.index
    values = np.empty((len(points), len(COLUMNS), len(index), len(HORIZON_POINTS)))
    for shard, camera, samples in index.by_camera():
        around = CameraObstacles(shard, camera)
        for sample in samples.tolist():
            frame = int(index.frame[sample])
            known = np.where(driven[:, None], around.headings(frame), np.nan)
            drivable = shard.drivable(camera, frame)
            found: dict[tuple[str, str], FloatArray] = {}
            for name, one in DEFINITIONS.items():
                faces = around.faces(frame, one.obstacles)
                there = Surrounding(sequences.future[sample], faces, drivable, index.grid)
                at_points = point_values(one, points[:, sample], there, known)
                found |= {(name, key): at_horizons(each, one.reading) for key, each in at_points.items()}
            values[:, :, sample] = np.stack([found[column] for column in COLUMNS], axis=1)
            tick()
    return values


def _scene_sums(values: FloatArray, scene: IntArray, scenes: int) -> FloatArray:
    """(scenes, R, columns, 3, 2) sums of values and how many there are, by scene."""
    defined = ~np.isnan(values)
    parts = np.stack([np.where(defined, values, 0.0), defined], axis=-1)
    sums = np.zeros((scenes, *parts.shape[:2], *parts.shape[3:]))
    np.add.at(sums, scene, np.moveaxis(parts, 2, 0))
    return sums
