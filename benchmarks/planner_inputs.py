"""What planners without images are fed: read from shards each time, read once and kept, side by side."""

import tempfile
from pathlib import Path

import torch
from bench_shards import extracted
from measure import show, side_by_side

from ogmkit.grid import GridSpec
from ogmkit.learn.data import reader
from ogmkit.learn.data.loader import keep_freed_memory
from ogmkit.learn.data.sequences import SequenceDataset
from ogmkit.learn.systems.planning import pooled
from ogmkit.samples.index import index_sequences
from ogmkit.samples.spec import SampleSpec
from ogmkit.shards.settings import ExtractSettings
from ogmkit.synthetic.build import synthesize
from ogmkit.synthetic.settings import SynthesisSettings
from ogmkit.target_settings import TargetSettings

CAMERA = "CAM_FRONT"
WORLD = SynthesisSettings(scenes=3, frames=40, cameras=(CAMERA,), image_size=(90, 160), lidar=False)
GRID, CELLS, PARTS = GridSpec(), 5500, (100, 55)
PATH = SampleSpec(trajectory=True)
MASKS = SampleSpec(bev_cell_m=GRID.m_per_cell, bev=True, trajectory=True)
AVERAGES = SampleSpec(trajectory=True, bev_parts=PARTS)
TURNS = 5


def main():
    torch.set_num_threads(1)
    keep_freed_memory()
    with tempfile.TemporaryDirectory() as folder:
        out = shards_in(Path(folder))
        rows = [
            row
            for system, before, now in (("lstm-ed", PATH, PATH), ("mid-to-end", MASKS, AVERAGES))
            for row in compared(out, system, before, now)
        ]
    show(
        f"A sequence for a planner, grid of {GRID.rows} × {GRID.columns}, masks in {CELLS} parts; one thread",
        ("", "time", "to memory"),
        rows,
    )


def shards_in(folder):
    """Shards of a synthetic world."""
    synthesize(folder / "world", WORLD)
    settings = ExtractSettings(TargetSettings(GRID, images="none"), (CAMERA,))
    extracted(folder / "world", folder / "out", settings)
    return folder / "out"


def compared(out, system, before, now):
    """A system's two rows."""
    scenes = [path.stem for path in sorted(out.glob("*.h5"))]
    index = index_sequences(out, scenes, (CAMERA,), needs=PATH)
    anew, kept = SequenceDataset(index, before), SequenceDataset(index, now)

    def from_shards():
        reader.MOST_KEPT_BYTES = 0
        for i in range(len(anew)):
            sample = anew[i]
            if "bev" in sample:
                pooled(sample["bev"], CELLS)

    def from_memory():
        reader.MOST_KEPT_BYTES = 1 << 30
        for i in range(len(kept)):
            kept[i]

    seconds = side_by_side({"from shards": from_shards, "from memory": from_memory}, TURNS)
    for name, value in seconds.items():
        ratio = value / seconds["from memory"]
        yield f"{system}, {name}", f"{1e3 * value / len(index):.3f} ms", f"{ratio:.1f}×"


main()
