"""A whole frame, from record to shard, against the OpenCV and h5py calls that it can't do without."""

import tempfile
from pathlib import Path

from bare_calls import prepare, write_bare
from measure import show, side_by_side

from ogmkit.nuscenes.dataset import Dataset
from ogmkit.nuscenes.maps import MaskStore
from ogmkit.shards.writer import write_shard
from ogmkit.synthetic.build import synthesize
from ogmkit.synthetic.settings import SynthesisSettings
from ogmkit.target_settings import TargetSettings

FRAMES = 20
REPEATS = 15
SETTINGS = TargetSettings()


def main():
    with tempfile.TemporaryDirectory() as folder:
        root, out = Path(folder) / "dataset", Path(folder) / "out"
        out.mkdir()
        settings = SynthesisSettings(
            scenes=1, frames=FRAMES, cameras=("CAM_FRONT",), image_size=(900, 1600), lidar=False
        )
        synthesize(root, settings)
        with Dataset(root) as dataset:
            scene = dataset.scene(dataset.scene_names()[0], ("CAM_FRONT",))
        frames = scene.cameras["CAM_FRONT"]
        masks = MaskStore(Path(folder) / "cache")
        prepared = [prepare(frame, masks, SETTINGS.grid) for frame in frames]
        ways = {
            "bare calls": lambda: write_bare(out / "bare.h5", prepared),
            "ogmkit": lambda: write_shard(
                out / "ogmkit.h5", scene, SETTINGS, masks, dataset_version=dataset.version
            ),
        }
        seconds = side_by_side(ways, REPEATS)
    rows = [
        (name, f"{1e3 * value / len(frames):.2f} ms", f"{value / seconds['bare calls']:.2f}×")
        for name, value in seconds.items()
    ]
    show(
        "A whole frame: rasters, boxes, trajectory, image, write (aim: ≤ 2×)",
        ("", "time", "to bare calls"),
        rows,
    )


main()
