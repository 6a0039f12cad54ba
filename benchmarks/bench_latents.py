"""A part that asks what the latent of a variational encoder–decoder tells of an image."""

import torch
from bench_data import CAMERA, data_of, scenes_of

from ogmkit.learn.data.frames import FrameDataset
from ogmkit.learn.predict.run import open_run
from ogmkit.samples.index import index_frames
from ogmkit.samples.spec import TARGETS

ACTIVE = 0.01
"""Least variance over images of a number's mean that counts as telling something (Burda et al. 2016)."""
BATCH = 16


def make_latents(bench, part):
    """Of each run and target, over the frames of `val`: numbers that vary, spread of the probabilities."""
    shards, _ = data_of(bench, part)
    scenes = scenes_of(bench, part)["val"]
    return {"latents": {run: _of_run(bench.at(run) / "run", shards, scenes) for run in part.settings["runs"]}}


def _of_run(run, shards, scenes):
    system = open_run(run).model.eval()
    spec = system.prediction_spec(None)
    frames = FrameDataset(index_frames(shards, scenes, (CAMERA,), needs=spec), spec)
    with torch.no_grad():
        answers = [system.answer(batch) for batch in torch.utils.data.DataLoader(frames, BATCH)]
    mu, logits = (torch.cat([answer[name] for answer in answers]) for name in ("mu", "logits"))
    spread = logits.sigmoid().std(0).mean((1, 2))
    return {
        target: {
            "active": int((mu[:, channel].var(0) > ACTIVE).sum()),
            "of": mu.shape[-1],
            "spread": round(float(spread[channel]), 4),
        }
        for channel, target in enumerate(TARGETS)
    }
