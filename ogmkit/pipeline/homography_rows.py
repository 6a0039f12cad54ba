"""Storing the homographies of a camera's frames in a shard."""

from collections.abc import Mapping, Sequence

import h5py
import numpy as np
from numpy.typing import ArrayLike

from ogmkit.homography.leave_out import LeftOutErrors
from ogmkit.homography.result import Homography
from ogmkit.shards.layout import store_dataset
from ogmkit.shards.schema import HOMOGRAPHY


def store_homographies(
    group: h5py.Group,
    found: Sequence[Homography],
    left_out: Sequence[LeftOutErrors],
    sizes: Mapping[str, int],
    *,
    with_plane: bool = False,
) -> None:
    """Fill an empty group `homography/<source>`; called within `ShardFile.writing()`.

    Args:
        group: the group.
        found: of every frame.
        left_out: errors of every frame's boxes.
        sizes: values of the schema's symbols for the camera.
        with_plane: whether the source fits planes.
    """
    columns: dict[str, ArrayLike] = {
        "bev_from_image": [one.bev_from_image for one in found],
        "valid": [one.valid for one in found],
        "reason": [one.reason for one in found],
        "num_points": [one.points_used for one in found],
        "rms_px": [one.rms_px for one in found],
        "rms_cells": [one.rms_cells for one in found],
        "left_out_error_m": np.concatenate([errors.error_m for errors in left_out]),
        "left_out_refused": np.concatenate([errors.refused for errors in left_out]),
    }
    if with_plane:
        nothing = np.full(3, np.nan)
        columns["plane"] = [nothing if one.plane is None else one.plane for one in found]
    for name, rows in columns.items():
        store_dataset(group, HOMOGRAPHY.field(name), rows, sizes)
