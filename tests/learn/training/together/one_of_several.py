"""One process of several that train together; which one it is stands in its environment, as torchrun sets it.

Arguments: the folder of shards, and trainings as JSON: [[system, settings, run], …], one after the other.
"""

import json
import sys
from pathlib import Path

import torch

from ogmkit.learn.catalogue import CATALOGUE
from ogmkit.learn.training.train import train

torch.set_num_threads(1)
for system, values, run in json.loads(sys.argv[2]):
    train(CATALOGUE[system].settings(**values), Path(sys.argv[1]), Path(run))
