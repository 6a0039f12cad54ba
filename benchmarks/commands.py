"""What the benchmarks of trained networks share: commands of ogmkit, a core each, two at a time."""

import json
import os
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from ogmkit.samples.splits import divide_scenes
from ogmkit.shards.manifest import read_manifest

OGMKIT = str(Path(sys.executable).with_name("ogmkit"))
JOBS = 2
"""Trainings at a time."""


def ogmkit(*arguments):
    """Run a command; what it prints goes to stderr."""
    command = [OGMKIT, *map(str, arguments)]
    print("$ ogmkit", *command[1:], file=sys.stderr, flush=True)
    environment = os.environ | {"OMP_NUM_THREADS": "1"}
    subprocess.run(command, check=True, env=environment, stdout=sys.stderr)


def divide(folder, shards, val, test):
    """Write a split file with so many scenes to choose the checkpoint by and to report; (file, division)."""
    names = [entry.scene for entry in read_manifest(shards).shards]
    train, held_out = names[: -val - test], names[-val - test :]
    path = folder / "splits.json"
    path.write_text(json.dumps({"train": train, "val": held_out[:val], "test": held_out[val:]}))
    return path, divide_scenes(shards, read_manifest(shards), split_file=path)


def train_all(folder, shards, splits, trainings):
    """Train {name: (system, option, …)} into folder/name, and give back the seconds of each."""

    def train(name):
        system, *options = trainings[name]
        started = time.monotonic()
        ogmkit("train", system, shards, "--out", folder / name, "--split-file", splits, *options)
        return name, time.monotonic() - started

    with ThreadPoolExecutor(JOBS) as pool:
        return dict(pool.map(train, trainings))


def told(seconds):
    """Seconds of trainings in one line."""
    return ", ".join(f"{name} {value:.0f}" for name, value in seconds.items())
