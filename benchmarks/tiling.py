"""Synthesized maps made as large as real ones: the devkit reads all of a map's polygons for each patch."""

import numpy as np


def tiled(layers, size_m, tiles, wanted=("drivable_area",)):
    """Repeat the polygons and lines of some layers of a map.

    Args:
        layers: the map's JSON.
        size_m: (east, north) size of one tile.
        tiles: (east, north) numbers of tiles.
        wanted: names of the layers; all others are empty.
    """
    result = {key: [] if isinstance(value, list) else value for key, value in layers.items()}
    result["canvas_edge"] = (np.array(size_m) * tiles).tolist()
    records = [record for name in wanted for record in layers[name]]
    shapes = {token for record in records for token in shape_tokens(record)}
    for tile in np.ndindex(*tiles):
        suffix = "-{}-{}".format(*tile)
        east_m, north_m = np.array(size_m) * tile
        result["node"] += [
            {"token": node["token"] + suffix, "x": node["x"] + east_m, "y": node["y"] + north_m}
            for node in layers["node"]
        ]
        for kind in ("polygon", "line"):
            result[kind] += [renamed(row, suffix) for row in layers[kind] if row["token"] in shapes]
        for name in wanted:
            result[name] += [renamed(row, suffix) for row in layers[name]]
    return result


def shape_tokens(record):
    """Tokens of a layer's record's polygons or line."""
    one = [record[key] for key in ("polygon_token", "line_token") if key in record]
    return record.get("polygon_tokens", one)


def renamed(record, suffix):
    """A map record whose own and others' tokens carry a suffix."""
    result = dict(record)
    for key, value in record.items():
        if key == "holes" or key.endswith("_segments"):
            result[key] = [renamed(part, suffix) for part in value]
        elif key in ("token", "node_token", "polygon_token", "line_token"):
            result[key] = value + suffix
        elif key.endswith("_tokens"):
            result[key] = [token + suffix for token in value]
    return result
