"""Table of what stands in the way on real images, of what `real_limits.py --format json` has written."""

from real_tables import is_of, text_of, told

NAME = "real-limits"
COLUMNS = {
    "drivable: camera": ("drivable", "camera", "full", "all"),
    "drivable: BEV close in view": ("drivable", "bev", "close", "fov"),
    "vehicles: camera": ("vehicles", "camera", "full", "all"),
    "vehicles: BEV close in view": ("vehicles", "bev", "close", "fov"),
}
"""Column → target, view, region and cells of the foreground's IoU."""


def text(results):
    """The table of all JSON files, or a line that says that there is none.

    Args:
        results: the folder of all benchmarks' results.
    """
    return text_of(results / NAME, summary)


def summary(records):
    """Means over seeds, with the least and the greatest, of all experiments."""
    lines = [f"| reported on | experiment | system | {' | '.join(COLUMNS)} |"]
    lines += ["| --- | --- | --- |" + " ---: |" * len(COLUMNS)]
    of_row = {}
    for one in records:
        row = one["test"].partition("-last")[0], one["experiment"], one["system"]
        of_row.setdefault(row, []).append(one)
    for row, own in of_row.items():
        cells = [
            told([one["value"] for one in own if is_of(one, target, *place)])
            for target, *place in COLUMNS.values()
        ]
        lines.append(f"| {' | '.join((*row, *cells))} |")
    return "\n".join(lines)
