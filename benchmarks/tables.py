"""Reading tables of trainval's size: ogmkit's `Dataset` against `json`, each in a process of its own."""

import argparse
import sys
import tempfile
from pathlib import Path

from big_tables import TABLES, Extent, write_tables
from measure import run_process, show

SCENES = 850
VERSION = "v1.0-trainval"
READ_JSON = """
import json, sys
from pathlib import Path
tables = {path.stem: json.loads(path.read_bytes()) for path in Path(sys.argv[1]).glob("*.json")}
"""
READ_OGMKIT = """
import sys
from pathlib import Path
from ogmkit.nuscenes.dataset import Dataset
with Dataset(Path(sys.argv[1])) as dataset:
    scene = dataset.scene(dataset.scene_names()[0], ("CAM_FRONT",))
    assert len(scene.cameras["CAM_FRONT"]) == 40
"""


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--scenes", type=int, default=SCENES, help="how many scenes to generate")
    scenes = parser.parse_args().scenes
    with tempfile.TemporaryDirectory() as folder:
        root = Path(folder)
        counts = write_tables(root, VERSION, Extent(scenes))
        json_s, json_mib = run_process([sys.executable, "-c", READ_JSON, str(root / VERSION)])
        ours_s, ours_mib = run_process([sys.executable, "-c", READ_OGMKIT, str(root)])
        size_gb = sum(path.stat().st_size for path in root.rglob("*.json")) / 1e9
    shown = ", ".join(f"{counts[name] / 1e6:.2f} M {name}" for name in TABLES)
    rows = [
        ("json, all tables", f"{json_s:.1f} s", "", f"{json_mib:.0f} MiB", ""),
        (
            "ogmkit, opened and one scene read",
            f"{ours_s:.1f} s",
            f"{json_s / ours_s:.1f}× faster",
            f"{ours_mib:.0f} MiB",
            f"1/{json_mib / ours_mib:.1f}",
        ),
    ]
    show(
        f"Tables of {scenes} scenes ({shown}; {size_gb:.1f} GB; aim: ≥ 8× faster in ≤ 1/8 of the memory)",
        ("", "time", "ratio", "peak", "share"),
        rows,
    )


main()
