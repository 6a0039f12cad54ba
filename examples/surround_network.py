"""Train a small network that lifts all cameras' images to the plane, as lift-splat-shoot does.

    ogmkit extract DATAROOT SHARDS --definition paper,surround --cell-size 0.5 --camera CAM_FRONT --camera …
    python examples/surround_network.py SHARDS [STEPS]

Samples come in the layout of that repository, whose own network takes them, too. By ten steps, it tells the
loss.
"""

import sys
from itertools import cycle, islice
from pathlib import Path

import torch
from torch import Tensor, nn
from torch.nn import functional
from torch.utils.data import DataLoader

from ogmkit import ShardFolder, divide_scenes
from ogmkit.torch import SurroundDataset, SurroundSpec, index_surround

STRIDE, CHANNELS = 8, 16
DEPTHS_M = torch.arange(2.0, 50.0, 2.0)


class LiftSplat(nn.Module):
    """From images of any cameras to logits (B, 1, rows, columns) on the plane: put yours here."""

    def __init__(self, cells: int, m_per_cell: float) -> None:
        super().__init__()
        self.cells, self.m_per_cell = cells, m_per_cell
        self.camera = nn.Conv2d(3, len(DEPTHS_M) + CHANNELS, STRIDE, stride=STRIDE)
        self.plane = nn.Sequential(nn.Conv2d(CHANNELS, 32, 5, padding=2), nn.ReLU(), nn.Conv2d(32, 1, 1))

    def forward(self, imgs: Tensor, *calibration: Tensor) -> Tensor:
        """Weigh features by depth, add them up where their points fall."""
        depth, features = self.camera(imgs.flatten(0, 1)).tensor_split([len(DEPTHS_M)], dim=1)
        lifted = depth.softmax(1)[:, None] * features[:, :, None]  # (B·C, channels, depths, h, w)
        points = points_of(lifted.shape[-2:], *(one.flatten(0, 1) for one in calibration))
        cell = (points[..., :2] / self.m_per_cell + self.cells / 2).floor().long()
        inside = ((cell >= 0) & (cell < self.cells)).all(-1)
        sample = torch.arange(len(lifted))[:, None, None, None] // imgs.shape[1]
        place = (sample * self.cells + cell[..., 0]) * self.cells + cell[..., 1]
        plane = lifted.new_zeros(len(imgs) * self.cells**2, CHANNELS)
        plane = plane.index_add(0, place[inside], lifted.movedim(1, -1)[inside])
        logits: Tensor = self.plane(plane.view(len(imgs), self.cells, self.cells, CHANNELS).movedim(-1, 1))
        return logits


def points_of(
    size: torch.Size, rots: Tensor, trans: Tensor, intrins: Tensor, post_rots: Tensor, post_trans: Tensor
) -> Tensor:
    """(N, depths, h, w, 3) metres in the frame of reference of the middles of features, at each depth."""
    v, u = ((torch.arange(side) + 0.5) * STRIDE - 0.5 for side in size)
    depth, v, u = torch.meshgrid(DEPTHS_M, v, u, indexing="ij")
    pixels = torch.stack([u, v, torch.ones_like(u)], -1)[None] - post_trans[:, None, None, None]
    rays = torch.linalg.inv(post_rots @ intrins)
    points = torch.einsum("nij,ndhwj->ndhwi", rots @ rays, pixels) * depth[None, ..., None]
    return points + trans[:, None, None, None]


def main(shards: Path, steps: int) -> None:
    """Train on vehicles of the scenes to learn from."""
    division = divide_scenes(shards, ShardFolder(shards).manifest)
    spec = SurroundSpec(image_size=(128, 352), crop_top=70, layout="lss", classes=("vehicles",))
    samples = SurroundDataset(index_surround(shards, division.train, needs=spec), spec)
    rows = samples.definition.grid.rows
    torch.manual_seed(0)
    network = LiftSplat(rows.cells, abs(rows.step_m))
    optimizer = torch.optim.AdamW(network.parameters(), lr=3e-3)
    batches = DataLoader(samples, batch_size=2, shuffle=True)
    for step, batch in enumerate(islice(cycle(batches), steps), start=1):
        *inputs, truth, _ = batch.values()
        loss = functional.binary_cross_entropy_with_logits(network(*inputs), truth)
        optimizer.zero_grad()
        loss.backward()  # type: ignore[no-untyped-call]  # torch's own is untyped
        optimizer.step()
        if step % 10 == 0:
            print(f"step {step}: loss {float(loss.detach()):.4f}")


if __name__ == "__main__":
    main(Path(sys.argv[1]), int(sys.argv[2]) if len(sys.argv) > 2 else 100)
