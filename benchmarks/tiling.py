"""Synthesized maps made as large as real ones: the devkit reads all of a map's polygons for each patch."""

import numpy as np


def tiled(layers, size_m, tiles):
    """Repeat the drivable polygons of a map.

    Args:
        layers: the map's JSON.
        size_m: (east, north) size of one tile.
        tiles: (east, north) numbers of tiles.
    """
    result = {key: [] if isinstance(value, list) else value for key, value in layers.items()}
    result["canvas_edge"] = (np.array(size_m) * tiles).tolist()
    areas = {token for area in layers["drivable_area"] for token in area["polygon_tokens"]}
    for tile in np.ndindex(*tiles):
        suffix = "-{}-{}".format(*tile)
        east_m, north_m = np.array(size_m) * tile
        result["node"] += [
            {"token": node["token"] + suffix, "x": node["x"] + east_m, "y": node["y"] + north_m}
            for node in layers["node"]
        ]
        result["polygon"] += [renamed(row, suffix) for row in layers["polygon"] if row["token"] in areas]
        result["drivable_area"] += [renamed(row, suffix) for row in layers["drivable_area"]]
    return result


def renamed(record, suffix):
    """A map record whose own and others' tokens carry a suffix."""
    result = dict(record)
    for key, value in record.items():
        if key == "holes":
            result[key] = [renamed(hole, suffix) for hole in value]
        elif key == "token":
            result[key] = value + suffix
        elif key.endswith("_tokens"):
            result[key] = [token + suffix for token in value]
    return result
