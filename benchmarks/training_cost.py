"""What a training step of each system asks of a machine at the paper's sizes: counted, no GPU needed.

Operations of a forward and backward pass (torch's FLOP counter), and the bytes that the forward pass keeps
for the backward one: most of a GPU's memory in training. Weights, gradients and momentum come on top:
12 bytes a weight with SGD in 32 bits. A frozen perception looks at each image once, before the first step.
"""

import sys

import torch
from measure import show
from torch.utils.flop_counter import FlopCounterMode

from ogmkit.grid import GridSpec
from ogmkit.learn.catalogue import CATALOGUE
from ogmkit.learn.systems.registry import build_system
from ogmkit.learn.training.looking import looks_once
from ogmkit.samples.index import SEQUENCE

FRAMES_OF_TRAINVAL = 28_130
"""Key frames of the 700 scenes of nuScenes' train split."""
SEQUENCES_OF_TRAINVAL = FRAMES_OF_TRAINVAL - 12 * 700
"""Of them, those with six before and six after in their scene."""
SUSTAINED_TFLOPS = 10.0
"""Of a data-centre GPU in 32-bit (TF32) convolutions; an assumption, not a measurement."""


VARIANTS = {
    **{name: {"system": name} for name in CATALOGUE},
    "holistic --checkpoint-gradients": {"system": "holistic", "checkpoint_gradients": True},
    "holistic --freeze perception": {"system": "holistic", "perception": "(a run)", "freeze": ["perception"]},
    "end-to-end --checkpoint-gradients": {"system": "end-to-end", "checkpoint_gradients": True},
}


def main():
    rows = []
    for name in sys.argv[1:] or VARIANTS:
        values = {"masks": "surface", **VARIANTS[name]}
        entry = CATALOGUE[values.pop("system")]
        settings = entry.settings(**entry.read(values))
        system = build_system(settings, GridSpec(), ("CAM_FRONT",))
        system.freeze_parts()
        system.train()
        weights = sum(weight.numel() for weight in system.parameters())
        flops, kept = step(system)
        memory = 12 * weights + settings.batch_size * kept
        samples = SEQUENCES_OF_TRAINVAL if system.plans else FRAMES_OF_TRAINVAL
        in_all = flops * samples * settings.epochs + FRAMES_OF_TRAINVAL * once(system)
        hours = in_all / (SUSTAINED_TFLOPS * 1e12) / 3600
        rows.append(
            (
                name,
                f"{weights / 1e6:.1f} M",
                f"{flops / 1e9:.0f}",
                f"{kept / 1e6:.0f} MB",
                f"{memory / 1e9:.1f} GB of {settings.batch_size}",
                f"{hours:.3g} h of {settings.epochs} epochs",
            )
        )
    show(
        f"A training step at the defaults; hours for {FRAMES_OF_TRAINVAL:,} frames, or "
        f"{SEQUENCES_OF_TRAINVAL:,} sequences of six, at {SUSTAINED_TFLOPS:.0f} TFLOP/s",
        ("system", "weights", "GFLOP/sample", "kept/sample", "memory, batch", "computed"),
        rows,
    )


def once(system):
    """Operations that a frame takes before the first step."""
    if not looks_once(system):
        return 0
    batch = batch_of(system)
    frame = {name: batch[name][0, :1] for name in ("image", "bev_from_image")}
    with FlopCounterMode(display=False) as counter, torch.no_grad():
        system.seen(frame)
    return counter.get_total_flops()


def step(system):
    """Operations, and bytes kept for the backward pass, a sample."""
    batch = batch_of(system)
    if looks_once(system):
        batch["features"] = torch.rand(1, SEQUENCE, system.feature_size())
        del batch["masks"]
    storages = {}

    def keep(tensor):
        storage = tensor.untyped_storage()
        storages[storage.data_ptr()] = storage.nbytes()
        return tensor

    mine = {weight.untyped_storage().data_ptr() for weight in (*system.parameters(), *system.buffers())}
    with FlopCounterMode(display=False) as counter:
        with torch.autograd.graph.saved_tensors_hooks(keep, lambda tensor: tensor):
            terms = system.losses(system.answer(batch), batch)
            loss = sum(terms.values())
        loss.backward()
    given = {value.untyped_storage().data_ptr() for value in batch.values()}
    kept = sum(size for place, size in storages.items() if place not in mine | given)
    return counter.get_total_flops(), kept


def batch_of(system):
    """A sample of noise: what it shows doesn't change what it costs."""
    height, width = getattr(system.settings, "image_size", (448, 800))  # some see no images
    rows, columns = getattr(system, "own_grid", system.grid).shape
    level_from_camera = torch.eye(4, dtype=torch.float64)
    level_from_camera[:3, :3] = torch.tensor([[0.0, 0, 1], [-1, 0, 0], [0, -1, 0]])
    level_from_camera[2, 3] = 1.5
    intrinsics = torch.tensor([[633.0, 0, 399.5], [0, 633, 223.5], [0, 0, 1]], dtype=torch.float64)
    homography = torch.tensor([[-0.1, 0.4, -200], [0, -0.2, -300], [0, 4e-3, -1]], dtype=torch.float64)
    if hasattr(system, "code"):
        near = homography * (1 + 1e-3 * torch.rand(8, 3, 3, dtype=torch.float64))
        code = type(system.code).fit(near, torch.zeros(8, dtype=torch.int64), 1, (height, width), system.grid)
        system.code.load_state_dict(code.state_dict())
    lead = (1, SEQUENCE) if system.plans else (1,)
    return {
        "image": torch.rand(*lead, 3, height, width),
        "masks": torch.rand(*lead, 2, height, width).round(),
        "bev": torch.rand(*lead, 2, rows, columns).round(),
        "bev_parts": torch.rand(*lead, 2, *(system.spec.bev_parts or (1, 1))),
        "bev_known": torch.ones(*lead, rows, columns),
        "lidar": torch.rand(*lead, 3, rows, columns),
        "bev_from_image": homography.expand(*lead, 3, 3),
        "intrinsics": intrinsics.expand(*lead, 3, 3),
        "level_from_camera": level_from_camera.expand(*lead, 4, 4),
        "positions": torch.rand(1, SEQUENCE, 2),
        "future": torch.rand(1, SEQUENCE, 2),
        "camera": torch.zeros(1, dtype=torch.int64),
        "mirrored": torch.zeros(1, dtype=torch.bool),
    }


main()
