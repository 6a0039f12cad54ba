"""Tables of the benchmark on real images, of what `real.py --format json` has written."""

import json

from real_parts import summary

NAME = "real"


def text(results):
    """Tables of all JSON files of a folder, or a line that says that there is none.

    Args:
        results: the folder of all benchmarks' results.
    """
    records = [
        one for path in sorted((results / NAME).glob("*.json")) for one in json.loads(path.read_text())
    ]
    return summary(records).rstrip() if records else "Not run yet."
