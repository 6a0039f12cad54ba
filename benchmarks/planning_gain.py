"""What there is to see: a planner from the past alone beside one that is also told where vehicles are.

A small regression from past and destination, with and without numbers taken from the annotated boxes (the
vehicle ahead: its gap and its last four speeds; up to three that stand near the way). What the second gains,
no planner that sees masks has to reach, but it shows that there is something to see.
"""

import numpy as np
import torch
from torch import nn

from ogmkit.shards.reader import Shard

CAMERA = "CAM_FRONT"
STEPS, BACK, STANDING = 5, 4, 3
AHEAD_M, NEAR_M = (-8.0, 45.0), 3.4
STILL_M_S = 0.15
MIRRORED = (1, *(3 + BACK + 5 * number + 1 for number in range(STANDING)))
"""Places of the numbers that change their sign in a mirror."""
BATCH, WIDTH = 32, 128


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


def read(index):
    """Past, future and what there is to see of the sequences of an index."""
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


def errors_m(train, test, *, is_told, seed, epochs):
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
    steps = epochs * len(given) // BATCH + 1
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


def regression_errors(training, reported, seeds, epochs):
    """{what it is told, seed by seed: (N, 5, 2) errors in metres}.

    Args:
        training: index of the sequences to learn from; their mirror images are learnt as well.
        reported: of the N sequences to score.
        seeds: of the networks.
        epochs: passes over the sequences.
    """
    train, test = read(training), read(reported)
    train = [np.concatenate(both) for both in zip(train, mirrored(*train), strict=True)]
    found = {}
    for is_told, name in ((False, "regression"), (True, "regression-told")):
        for seed in seeds:
            found[f"{name}-{seed}"] = errors_m(train, test, is_told=is_told, seed=seed, epochs=epochs)
    return found
