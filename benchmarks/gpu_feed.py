"""What one GPU eats and how many loader workers feed it: operations computed, frames a worker measured.

`python benchmarks/gpu_feed.py [TFLOPS]`: what the GPU sustains, 100 unless given. No GPU is needed.
"""

import sys
import tempfile
from pathlib import Path

import cv2
import numpy as np
import torch
from loading import SAMPLES, dataset_of, prepare, timed
from measure import show
from torch.utils.flop_counter import FlopCounterMode

from ogmkit.learn.data.loader import keep_freed_memory
from ogmkit.learn.models.footprint_net import FootprintNet

SIZE = 448, 800
ENCODERS = ("tu-tf_efficientnet_lite0", "mobilenet_v2", "resnet18", "resnet34", "resnet50", "resnet101")
DEFAULT_TFLOPS = 100.0


def main():
    cv2.setNumThreads(1)
    torch.set_num_threads(1)
    keep_freed_memory()  # as the loader's workers do
    sustained = float(sys.argv[1]) if len(sys.argv) > 1 else DEFAULT_TFLOPS
    a_worker = 1 / measured()
    rows = []
    for encoder in ENCODERS:
        parameters, operations = training_cost(encoder)
        frames = sustained * 1e12 / operations
        rows.append(
            (
                encoder,
                f"{parameters / 1e6:.1f} M",
                f"{operations / 1e9:.0f} GFLOP",
                f"{frames:.0f}",
                f"{frames / a_worker:.0f}",
            )
        )
    show(
        f"`footprints` on {SIZE[0]} × {SIZE[1]}: forward and backward of a frame; frames a second at "
        f"{sustained:g} TFLOP/s\nA worker reads {a_worker:.0f} frames a second (image, masks, calibration)",
        ("encoder", "parameters", "a frame", "frames/s", "workers"),
        rows,
    )


def measured():
    """Seconds of a frame sample in one thread: median, each the best of some turns."""
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "shards"
        scenes = prepare(Path(folder) / "dataset", out)
        dataset = dataset_of(out, scenes, "frame", SIZE, 1.0)
        places = range(0, len(dataset), max(1, len(dataset) // SAMPLES))
        return float(np.median(timed(dataset, places).min(axis=0)))


def training_cost(encoder):
    """Parameters, and operations of a frame's forward and backward; shapes alone are computed.

    A backward takes twice the forward: gradients by inputs and by weights. torch's counter takes depthwise
    convolutions for dense ones there.
    """
    with torch.device("meta"):
        net = FootprintNet(encoder)
        image = torch.rand(2, 3, *SIZE)  # two: normalisation wants more than one value
    with FlopCounterMode(display=False) as counter:
        net(image)
    return sum(one.numel() for one in net.parameters()), 3 * counter.get_total_flops() / 2


if __name__ == "__main__":
    main()
