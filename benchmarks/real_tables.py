"""Tables of the benchmark on real images, of what `real.py --format json` has written."""

import json

NAME = "real"
COLUMNS = {
    "camera": ("camera", "full", "all"),
    "BEV close in view": ("bev", "close", "fov"),
    "BEV full": ("bev", "full", "all"),
}
"""Column → view, region and cells of the foreground's IoU."""


def text(results):
    """Tables of all JSON files, or a line that says that there is none.

    Args:
        results: the folder of all benchmarks' results.
    """
    paths = sorted((results / NAME).glob("*.json"))
    records = [one for path in paths for one in json.loads(path.read_text())]
    return summary(records).rstrip() if records else "Not run yet."


def summary(records):
    """Means over seeds, with the least and the greatest, a table for each way round."""
    lines = []
    for way in dict.fromkeys((one["train"], one["test"]) for one in records):
        of_way = [one for one in records if (one["train"], one["test"]) == way]
        header = [f"{target}: {column}" for target in ("drivable", "vehicles") for column in COLUMNS]
        lines += [f"Foreground IoU, %, learnt from {way[0]}, reported on {way[1]}", ""]
        lines += [f"| system | start | {' | '.join(header)} |", "| --- | --- |" + " ---: |" * len(header)]
        for system, start in dict.fromkeys(
            (one["system"], one["start"]) for one in of_way if one["metric"] == "foreground_iou"
        ):
            own = [one for one in of_way if (one["system"], one.get("start")) == (system, start)]
            cells = [
                told([one["value"] for one in own if is_of(one, target, *place)])
                for target in ("drivable", "vehicles")
                for place in COLUMNS.values()
            ]
            lines.append(f"| {system} | {start or ''} | {' | '.join(cells)} |")
        lines += ["", *error_lines(of_way), ""]
    return "\n".join(lines)


def error_lines(records):
    """Medians of homographies' errors by range, and planners' ADE up to the last horizon, in metres."""
    found = {}
    for one in records:
        place = None
        if one["metric"] == "error_median_m":
            place = one["region"]
        elif (one["metric"], one.get("reading"), one.get("horizon_s")) == ("ade", "mean", 2.5):
            place = "ADE to 2.5 s"
        if place is not None and one["value"] is not None:
            found.setdefault((one["system"], one["start"] or "", place), []).append(one["value"])
    yield "| in metres | start | what | mean over seeds, least and greatest |"
    yield "| --- | --- | --- | ---: |"
    for (system, start, place), values in found.items():
        yield f"| {system} | {start} | {place} | {with_range(values, '.3g')} |"


def is_of(record, target, view, region, cells):
    """Whether a record is a column's."""
    wanted = {"target": target, "view": view, "region": region, "cells": cells, "metric": "foreground_iou"}
    return all(record.get(key) == value for key, value in wanted.items())


def told(values):
    """`48.1 (47.0–49.5)`, `48.1`, or NA."""
    known = [100 * value for value in values if value is not None]
    if not known:
        return "NA"
    return with_range(known, ".1f")


def with_range(values, form):
    """`48.1 (47.0–49.5)`: the mean, with the least and the greatest; one value as it is."""
    mean = format(sum(values) / len(values), form)
    return mean if len(values) == 1 else f"{mean} ({min(values):{form}}–{max(values):{form}})"
