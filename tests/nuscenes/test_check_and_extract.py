"""What `check` calls an error for a use fails there, and what it calls a warning doesn't."""

import pytest

from ogmkit.grid import GridSpec
from ogmkit.nuscenes.check import check_dataset
from ogmkit.nuscenes.dataset import Dataset
from ogmkit.nuscenes.uses import Use
from ogmkit.pipeline.extract import extract
from ogmkit.shards.settings import ExtractSettings
from ogmkit.target_settings import TargetSettings

GRID = GridSpec(2.0, 20, 10, 20.0, 5.0)
USES = {
    "front": Use(),
    "both": Use(("CAM_BACK", "CAM_FRONT")),
    "no images": Use(images=False),
    "with LiDAR": Use(lidar="LIDAR_TOP"),
    "no map": Use(maps=False),
}
FILES = ("samples/CAM_FRONT/1-2.jpg", "samples/CAM_BACK/1-2.jpg", "samples/LIDAR_TOP/1-2.bin", "maps/1.png")
RECORDS = (
    ("ego_pose", "pose-samples-1-2-CAM_FRONT", {"rotation": [0, 0, 0, 2]}),
    ("ego_pose", "pose-samples-1-2-CAM_BACK", {"translation": "here"}),
    ("ego_pose", "pose-samples-1-2-LIDAR_TOP", {"rotation": [0, 0, 0, 2]}),
    ("ego_pose", "pose-sweeps-1-2-CAM_FRONT", {"rotation": [0, 0, 0, 2]}),
    ("sample_data", "samples-1-2-CAM_BACK", {"is_key_frame": False}),
    ("sample_annotation", "annotation-1-2-vehicle.car", {"size": [0, 1, 1]}),
    ("sample_annotation", "annotation-1-2-vehicle.car", {"next": ""}),
    ("map", "map-1", {"log_tokens": []}),
    ("map", "map-1", {"filename": "/maps/1.png"}),
)


def _agree(root, out, use):
    images = "bytes" if use.images else "none"
    targets = TargetSettings(GRID, images=images, lidar=use.lidar is not None, no_map=not use.maps)
    with Dataset(root) as dataset:
        summary = extract(
            dataset,
            out / "shards",
            ExtractSettings(targets, use.cameras),
            scenes=dataset.scene_names(),
            splits={},
            cache_dir=out / "cache",
        )
    errors = [finding for finding in check_dataset(root, use=use) if finding.severity == "error"]
    assert bool(errors) == bool(summary.failures), (errors, summary.failures)
    return bool(errors)


@pytest.mark.sampled(5)
@pytest.mark.parametrize("use", USES.values(), ids=USES)
@pytest.mark.parametrize("name", FILES)
def test_a_file_that_is_absent(small_root, tmp_path, name, use):
    (small_root / name).unlink()

    _agree(small_root, tmp_path, use)


@pytest.mark.sampled(8)
@pytest.mark.parametrize("use", [USES[name] for name in ("both", "with LiDAR", "no map")])
@pytest.mark.parametrize(("table", "token", "values"), RECORDS)
def test_a_record_that_is_wrong(small_root, tmp_path, damage, table, token, values, use):
    damage(table, token, **values)

    _agree(small_root, tmp_path, use)
