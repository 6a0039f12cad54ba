"""Train a network of your own on shards; the library reads, decodes, resizes and batches.

    python examples/own_network.py SHARDS [EPOCHS]

SHARDS is a folder that `ogmkit extract`, or own_dataset.py, wrote. Takes an image, gives drivable area and
vehicles from above. By epoch, it tells the loss on the split train and the IoU of both on the split val.
"""

import sys
from itertools import pairwise
from pathlib import Path

import torch
from torch import Tensor, nn
from torch.nn import functional

from ogmkit import ShardFolder, divide_scenes
from ogmkit.torch import BatchLoader, EpochBatches, FrameDataset, SampleSpec, index_frames, loader


def own_network(rows: int, columns: int) -> nn.Module:
    """From images (B, 3, h, w) to logits (B, 2, rows, columns): put yours here."""
    layers: list[nn.Module] = []
    for inputs, outputs in pairwise((3, 16, 32, 64)):
        layers += [nn.Conv2d(inputs, outputs, 3, stride=2), nn.BatchNorm2d(outputs), nn.ReLU()]
    layers += [nn.AdaptiveAvgPool2d((6, 10)), nn.Flatten(), nn.Linear(64 * 60, 128), nn.ReLU()]
    return nn.Sequential(*layers, nn.Linear(128, 2 * rows * columns), nn.Unflatten(1, (2, rows, columns)))


def iou(network: nn.Module, samples: BatchLoader) -> Tensor:
    """(2,) intersection over union of drivable area and vehicles, summed over all frames."""
    intersection, union = torch.zeros(2), torch.zeros(2)
    network.eval()
    with torch.inference_mode():
        for batch in samples:
            found, truth = network(batch["image"]) > 0, batch["bev"] > 0
            intersection += (found & truth).sum((0, 2, 3))
            union += (found | truth).sum((0, 2, 3))
    return intersection / union


def main(shards: Path, epochs: int) -> None:
    """Train on the scenes to learn from, score on those to choose by; a division's others are to report."""
    folder = ShardFolder(shards)
    division, grid = divide_scenes(shards, folder.manifest), folder.grid
    # What samples hold: images of one size, and the truth on cells of at most 1 m, made of the shards' cells.
    cells = range(1, 1 + int(1 / grid.m_per_cell))
    factor = max((n for n in cells if grid.rows % n == grid.columns % n == 0), default=1)
    spec = SampleSpec(image_size=(96, 160), bev_cell_m=factor * grid.m_per_cell, bev=True)
    train, val = (
        FrameDataset(index_frames(shards, scenes, [], needs=spec), spec)
        for scenes in (division.train, division.val)
    )
    order = EpochBatches(len(train), 8, seed=0, shuffle=True)
    batches = loader(train, order, workers=0)  # more workers read ahead
    val_batches = loader(val, EpochBatches(len(val), 8, seed=0, shuffle=False), workers=0)

    torch.manual_seed(0)
    network = own_network(grid.rows // factor, grid.columns // factor)
    optimizer = torch.optim.AdamW(network.parameters(), lr=1e-3)
    for epoch in range(epochs):
        order.epoch = epoch  # an order of its own
        total = 0.0
        network.train()
        for batch in batches:
            loss = functional.binary_cross_entropy_with_logits(network(batch["image"]), batch["bev"])
            optimizer.zero_grad()
            loss.backward()  # type: ignore[no-untyped-call]  # torch's own is untyped
            optimizer.step()
            total += float(loss.detach()) * len(batch["index"])
        drivable, vehicles = iou(network, val_batches).tolist()
        print(f"epoch {epoch + 1}: loss {total / len(train):.4f}, IoU {drivable:.3f} and {vehicles:.3f}")


if __name__ == "__main__":
    main(Path(sys.argv[1]), int(sys.argv[2]) if len(sys.argv) > 2 else 10)
