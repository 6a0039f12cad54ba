"""The card of a Hugging Face dataset: which files make up each split, as `datasets.load_dataset` reads it."""

import re
from collections import defaultdict
from collections.abc import Iterator, Sequence
from pathlib import Path

from ogmkit.base.atomic import replacing
from ogmkit.pipeline.exports.record import ExportedFile

NAME = "README.md"
NO_SPLIT = "unassigned"
"""The split of scenes that belong to none."""


def write_card(out: Path, files: Sequence[ExportedFile]) -> None:
    """Write the folder's card; a configuration a table.

    Args:
        out: the folder.
        files: all of it.

    Raises:
        OutputError: the disk refuses.
    """
    tables = dict.fromkeys(one.table for one in files)
    lines = ["---", "configs:"]
    for number, table in enumerate(tables):
        lines += [f"- config_name: {table}", *(["  default: true"] if number == 0 else []), "  data_files:"]
        lines += _data_files([one for one in files if one.table == table])
    lines += ["---", "", "Bird's-eye-view ground truth, written by `ogmkit export-shards`.", ""]
    with replacing(out / NAME) as part:
        part.write_text("\n".join(lines), encoding="utf-8")


def _data_files(files: Sequence[ExportedFile]) -> Iterator[str]:
    splits: dict[str, list[str]] = defaultdict(list)
    for one in files:
        for split in one.splits or (NO_SPLIT,):
            splits[re.sub(r"\W", "_", split)].append(one.file)
    for split, paths in splits.items():
        yield f"  - split: {split}"
        yield "    path:"
        yield from (f'    - "{path}"' for path in paths)
