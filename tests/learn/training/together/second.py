"""The second of two processes that train together, by the environment that torchrun would set.

Arguments: the folder of shards, and trainings as JSON: [[system, settings, run], …], one after the other.
"""

import json
import sys
from pathlib import Path

import torch

from ogmkit.learn.catalogue import CATALOGUE
from ogmkit.learn.training.train import train

torch.set_num_threads(1)
print("ready", flush=True)
for system, values, run in json.loads(sys.argv[2]):
    summary = train(CATALOGUE[system].settings(**values), Path(sys.argv[1]), Path(run))
    assert summary is None  # the first process tells
