"""What there is to see: a planner from the past alone beside one that is also told where vehicles are.

`python benchmarks/planning_gain.py [FOLDER]`, on the shards that `benchmarks/planning.py` made: a small
regression from past and destination, with and without numbers taken from the annotated boxes (the vehicle
ahead: its gap and its last four speeds; up to three that stand near the way). What the second gains, no
planner that sees masks has to reach, but it shows that there is something to see.
"""

import sys
from pathlib import Path

import numpy as np
import torch
from torch import nn

from ogmkit.samples.index import index_sequences
from ogmkit.samples.spec import SampleSpec
from ogmkit.samples.splits import divide_scenes
from ogmkit.shards.manifest import read_manifest
from ogmkit.shards.reader import Shard

CAMERA = "CAM_FRONT"
STEPS, BACK, STANDING = 5, 4, 3
AHEAD_M, NEAR_M = (-8.0, 45.0), 3.4
STILL_M_S = 0.15
MIRRORED = (1, *(3 + BACK + 5 * number + 1 for number in range(STANDING)))
"""Places of the numbers that change their sign in a mirror."""
EPOCHS, BATCH, WIDTH, SEEDS = 60, 32, 128, range(3)


def trail(instance, boxes):
    """Where a vehicle is at a frame and those before, as far back as it is known without a gap."""
    places = []
    for frame in boxes:
        if instance not in frame:
            break
        places.append(frame[instance][:2])
    return places


def tell(boxes, times_s):
    """Numbers about vehicles, from {instance: (x, y, heading, width, length)} of a frame and those before."""
    leader, standing = None, []
    for instance, (x, y, heading, width, length) in boxes[0].items():
        places = trail(instance, boxes)
        speeds = np.linalg.norm(np.diff(places, axis=0), axis=1) / -np.diff(times_s[: len(places)])
        if not len(speeds) or np.mean(speeds) < STILL_M_S:
            if AHEAD_M[0] < x < AHEAD_M[1] and abs(y) < NEAR_M:
                standing.append((x, y, width, length, 1.0))
        elif x > 3 and abs(y) < 1.8 + 0.12 * x and np.cos(heading) > 0.3 and (not leader or x < leader[0]):
            speeds = np.concatenate([speeds, np.full(BACK, speeds[-1])])[:BACK]
            leader = (x, y, length, *speeds)
    found = list(leader) if leader else [60.0, 0.0, 0.0, *[8.0] * BACK]
    nothing = (50.0, 0.0, 0.0, 0.0, 0.0)
    for one in [*sorted(standing), *[nothing] * STANDING][:STANDING]:
        found += one
    return found


def read(shards, scenes):
    """Past, future and what there is to see of all sequences of some scenes."""
    index = index_sequences(shards, scenes, (CAMERA,), needs=SampleSpec(trajectory=True), valid_only=False)
    parts = []
    for number, path in enumerate(index.paths):
        with Shard(path) as shard:
            names = ("trajectory/past", "trajectory/future", "level_from_global", "timestamp_us")
            past, future, level, times = (shard.dataset(CAMERA, name)[:] for name in names)
            first = shard.dataset(CAMERA, "boxes/offsets")[:]
            poses, sizes = (
                shard.dataset(CAMERA, f"boxes/{name}")[:] for name in ("global_from_box", "size_wlh")
            )
            kinds, instances = (
                shard.strings(CAMERA, f"boxes/{name}") for name in ("category", "instance_token")
            )
        for frame in index.frame[index.shard == number]:
            boxes = []
            for seen in range(frame, frame - BACK - 1, -1):
                rows = [
                    row for row in range(first[seen], first[seen + 1]) if kinds[row].startswith("vehicle.")
                ]
                local = level[frame] @ poses[rows]
                heading = np.arctan2(local[:, 1, 0], local[:, 0, 0])
                table = np.column_stack([local[:, :2, 3], heading, sizes[rows, :2]])
                boxes.append({instances[row]: tuple(values) for row, values in zip(rows, table, strict=True)})
            told = tell(boxes, times[frame - np.arange(BACK + 1)] * 1e-6)
            parts.append((past[frame], future[frame], np.array(told)))
    return [np.stack(part).astype(np.float32) for part in zip(*parts, strict=True)]


def mirrored(past, future, told):
    """The same left to right."""
    told = told.copy()
    told[:, MIRRORED] *= -1
    return [past * np.float32([1, -1]), future * np.float32([1, -1]), told]


def inputs(past, future, told):
    """What both regressions know, and what the second is told."""
    return np.concatenate(
        [past.reshape(len(past), -1), future[:, STEPS], np.ones((len(past), 1), np.float32)], 1
    ), told


def errors_m(train, test, *, is_told, seed):
    """(N, 5, 2) errors on `test` of a network that adds to a linear fit from past and destination."""
    torch.manual_seed(seed)
    (base, more), (test_base, test_more) = inputs(*train), inputs(*test)
    target = train[1][:, :STEPS].reshape(len(base), -1)
    linear = np.linalg.lstsq(base, target, rcond=None)[0]
    given, test_given = base, test_base
    if is_told:
        given, test_given = np.hstack([base, more]), np.hstack([test_base, test_more])
    mean, spread = given.mean(0), given.std(0) + 1e-3
    given, test_given = (torch.from_numpy((part - mean) / spread) for part in (given, test_given))
    rest = torch.from_numpy(target - base @ linear)
    network = nn.Sequential(
        nn.Linear(given.shape[1], WIDTH), nn.ReLU(), nn.Dropout(0.1),
        nn.Linear(WIDTH, WIDTH), nn.ReLU(), nn.Linear(WIDTH, rest.shape[1]),
    )  # fmt: skip
    steps = EPOCHS * len(given) // BATCH
    optimizer = torch.optim.AdamW(network.parameters(), weight_decay=0.05)
    schedule = torch.optim.lr_scheduler.OneCycleLR(optimizer, 5e-3, total_steps=steps)
    for _ in range(steps):
        rows = torch.randint(len(given), (BATCH,))
        loss = (network(given[rows]) - rest[rows]).abs().mean()
        optimizer.zero_grad()
        loss.backward()
        optimizer.step()
        schedule.step()
    with torch.no_grad():
        found = network.eval()(test_given).numpy() + test_base @ linear
    return found.reshape(-1, STEPS, 2) - test[1][:, :STEPS]


def main():
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else ".bench/planning").resolve()
    torch.set_num_threads(1)
    shards = folder / "shards"
    division = divide_scenes(shards, read_manifest(shards), split_file=folder / "splits.json")
    train, test = (read(shards, scenes) for scenes in (division.train, division.test))
    train = [np.concatenate(both) for both in zip(train, mirrored(*train), strict=True)]
    print(
        "Metres, mean up to 2.5 s:\n\n| told | ADE | longitudinal | lateral |\n| --- | ---: | ---: | ---: |"
    )
    for is_told, name in ((False, "past, destination"), (True, "vehicles, too")):
        for seed in SEEDS:
            errors = errors_m(train, test, is_told=is_told, seed=seed)
            figures = np.linalg.norm(errors, axis=-1).mean(), *np.abs(errors).mean((0, 1))
            print(f"| {name}, seed {seed} |", *(f"{figure:.3f} |" for figure in figures))


if __name__ == "__main__":
    main()
