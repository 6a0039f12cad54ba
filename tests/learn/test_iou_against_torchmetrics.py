"""Our IoU is torchmetrics', and an evaluation of a real run is what its predictions say."""

import numpy as np
import pytest
import torch
from torchmetrics.classification import BinaryJaccardIndex, MulticlassJaccardIndex

from ogmkit.evaluation.evaluate import evaluate
from ogmkit.evaluation.settings import EvaluateSettings
from ogmkit.grid import GridSpec
from ogmkit.learn.catalogue import settings_from_dict
from ogmkit.learn.predict.run import open_run
from ogmkit.learn.training.train import train
from ogmkit.metrics.iou import BevCounter, code_of, iou, thresholded
from ogmkit.samples.index import index_frames
from ogmkit.samples.spec import TARGETS, SampleSpec
from ogmkit.shards.manifest import read_manifest
from ogmkit.shards.reader import Shard

GRID = GridSpec(m_per_cell=10, rows=7, columns=5, ego_row=7, ego_column=3)
REGIONS = {
    "full": (slice(None), slice(None)),
    "close": (slice(2, 7), slice(2, 4)),
    "far": (slice(0, 2), slice(None)),
}
UNSEEN = -1


@pytest.mark.parametrize("threshold", [0.3, 0.5])
def test_sums_over_frames_of_random_masks(threshold):
    generator = np.random.default_rng(5)
    frames = 6
    truth = generator.integers(0, 2, (frames, 2, 7, 5)).astype(np.uint8)
    seen = generator.integers(0, 2, (frames, 7, 5)).astype(np.uint8)
    found = generator.random((frames, 2, 7, 5)).astype(np.float32)
    counter = BevCounter(GRID)
    counts = sum(
        counter.count(code_of(*truth[i]), seen[i], thresholded(found[i], threshold)) for i in range(frames)
    )
    ours = iou(counts)

    for t in range(len(TARGETS)):
        for r, place in enumerate(REGIONS.values()):
            for c, known in enumerate((np.ones_like(seen), seen)):
                labels = np.where(known > 0, truth[:, t].astype(int), UNSEEN)[:, *place]
                shown = torch.from_numpy(found[:, t][:, *place])
                foreground = BinaryJaccardIndex(threshold, ignore_index=UNSEEN)
                mean = MulticlassJaccardIndex(2, average="macro", ignore_index=UNSEEN)
                expected = (
                    foreground(shown, torch.from_numpy(labels)),
                    mean((shown > threshold).long(), torch.from_numpy(labels)),
                )
                np.testing.assert_allclose(ours[t, r, c], [float(one) for one in expected], rtol=1e-6)


def test_a_trained_run_is_scored_by_what_it_predicts(learn_shards, tmp_path):
    settings = settings_from_dict(
        {
            "system": "footprints",
            "encoder": "tu-test_resnet",
            "image_size": (32, 64),
            "max_steps": 1,
            "batch_size": 2,
            "limit_frames": 2,
            "workers": 0,
        }
    )
    train(settings, learn_shards, tmp_path / "run")
    evaluation = evaluate(learn_shards, [open_run(tmp_path / "run")], EvaluateSettings(threshold=0.45))

    run = open_run(tmp_path / "run")
    scene = read_manifest(learn_shards).split("val")[0].scene
    metrics = {(target, view): BinaryJaccardIndex(0.45) for target in TARGETS for view in ("bev", "camera")}
    with Shard(learn_shards / f"{scene}.h5") as shard:
        index = index_frames(learn_shards, (scene,), run.cameras, needs=SampleSpec(), valid_only=False)
        for one in run.frames(index, "surface", batch_size=8, workers=0):
            for t, target in enumerate(TARGETS):
                true = shard.dataset(one.camera, target)[one.frame].astype(np.int64)
                metrics[target, "bev"].update(torch.from_numpy(one.bev[t]), torch.from_numpy(true))
                masks = shard.dataset(one.camera, f"footprints/surface/{target}")[one.frame].astype(np.int64)
                enlarged = torch.nn.functional.interpolate(
                    torch.from_numpy(one.image[None]), masks.shape, mode="bilinear", align_corners=False
                )
                metrics[target, "camera"].update(enlarged[0, t], torch.from_numpy(masks))
    assert evaluation.homography == "surface"
    for figure in evaluation.figures:
        if (figure.system, figure.region, figure.cells, figure.metric) == (
            "footprints",
            "full",
            "all",
            "foreground_iou",
        ):
            expected = float(metrics.pop((figure.target, figure.view)).compute())
            assert figure.value == pytest.approx(expected, abs=1e-3)
    assert not metrics
