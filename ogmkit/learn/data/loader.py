"""Batches of an epoch: what is in them depends on seed, epoch and place only, not on the workers."""

import ctypes
import sys
from collections.abc import Iterator, Sequence
from typing import Any

import cv2
import numpy as np
import torch
from torch import Tensor
from torch.utils.data import DataLoader, Dataset, Sampler

from ogmkit.base.interrupts import interrupts_blocked
from ogmkit.errors import OgmkitError, SettingsError

Key = tuple[int, int]
"""Place of a sample in its dataset, and seed of its augmentation."""

_M_TRIM_THRESHOLD, _M_MMAP_THRESHOLD = -1, -3
"""Names of settings in glibc's `malloc.h`."""
_LARGEST_KEPT = 32 << 20
"""Bytes of the largest array that is kept: glibc takes no more."""
_MOST_KEPT = 256 << 20
"""Bytes that are kept at most: several samples' worth."""


class EpochBatches(Sampler[list[Key]]):
    """Batches of an epoch's samples, as a batch sampler.

    An epoch's order and each sample's augmentation are functions of (seed, epoch, place in the dataset)
    alone, so a training that was killed resumes with the next batch.

    Args:
        count: samples of the dataset.
        batch_size: samples of a batch, on each device.
        seed: of order and augmentation.
        shuffle: whether the order is random.
        drop_last: leave out what fills no whole batch; with several devices, no whole round of them.
        rank: of this device.
        world: number of devices. They take turns over the batches; where these end in mid-round, the
            epoch's first ones fill it up.

    Attributes:
        epoch: the epoch of the next iteration.
        skip: how many of this device's batches the next iteration leaves out, from the epoch's start.
        rank: of this device.
        world: number of devices.

    Raises:
        SettingsError: the batch size is not positive.
    """

    def __init__(
        self,
        count: int,
        batch_size: int,
        *,
        seed: int,
        shuffle: bool,
        drop_last: bool = False,
        rank: int = 0,
        world: int = 1,
    ) -> None:
        if batch_size < 1:
            raise SettingsError(f"batch size: {batch_size} is not positive")
        self.epoch = 0
        self.skip = 0
        self.rank = rank
        self.world = world
        self._count = count
        self._batch_size = batch_size
        self._seed = seed
        self._shuffle = shuffle
        self._drop_last = drop_last

    def __len__(self) -> int:
        """Batches of a whole epoch, whatever `skip` leaves out of the next one."""
        return self._rounds

    def __iter__(self) -> Iterator[list[Key]]:
        rng = np.random.default_rng((self._seed, self.epoch))
        seeds = rng.integers(1 << 62, size=self._count)
        order = rng.permutation(self._count) if self._shuffle else np.arange(self._count)
        for turn in range(self.skip, self._rounds):
            batch = (turn * self.world + self.rank) % self._batches
            places = order[batch * self._batch_size : (batch + 1) * self._batch_size]
            yield [(int(place), int(seeds[place])) for place in places]

    def repeats(self, turn: int) -> bool:
        """Whether this device's batch of a turn only fills up the last round: another one has it, too."""
        return turn * self.world + self.rank >= self._batches

    @property
    def _batches(self) -> int:
        """Batches over all devices."""
        whole, rest = divmod(self._count, self._batch_size)
        return whole + (rest > 0 and not self._drop_last)

    @property
    def _rounds(self) -> int:
        """Batches of one device."""
        return self._batches // self.world if self._drop_last else -(-self._batches // self.world)


class SceneBatches(Sampler[list[Key]]):
    """Batches of all samples in order, none of which goes beyond its scene.

    What is computed of a scene is then the same to the last digit whichever other scenes there are.

    Args:
        counts: samples of each scene.
        batch_size: samples of a batch; a scene's last one may have fewer.

    Raises:
        SettingsError: the batch size is not positive; as the batches are read.
    """

    def __init__(self, counts: Sequence[int], batch_size: int) -> None:
        self._counts = counts
        self._batch_size = batch_size

    def __iter__(self) -> Iterator[list[Key]]:
        start = 0
        for count in self._counts:
            for keys in EpochBatches(count, self._batch_size, seed=0, shuffle=False):
                yield [(start + place, seed) for place, seed in keys]
            start += count


class BatchLoader(DataLoader[dict[str, Tensor]]):
    """A DataLoader whose workers' errors read as they were raised: one line, without a traceback."""

    def __iter__(self) -> Any:  # noqa: ANN401  # torch's own iterator is private
        batches = None
        try:
            with interrupts_blocked():  # in the workers, for good: Ctrl-C lets a step end, which needs them
                batches = super().__iter__()
            yield from batches
            return
        except OgmkitError as error:
            # A worker's error arrives as the text of its traceback, which ends in "<class>: <message>".
            *traceback, last = str(error).rstrip().split("\n")
            kind, message = type(error), last.partition(": ")[2] if traceback else last
            error.__traceback__ = None
        # Nothing refers to torch's iterator any more, so that it ends its workers at once. Where the garbage
        # collector finds it, it has lost their queues and waits for them in vain.
        batches = self._iterator = None
        raise kind(message)


def loader(dataset: Dataset[dict[str, Tensor]], batches: Sampler[list[Key]], *, workers: int) -> BatchLoader:
    """A loader of batches.

    Args:
        dataset: takes the keys that `batches` yields.
        batches: which samples make which batch.
        workers: processes that read ahead and stay for all epochs; 0 or 1 reads in this one. They are
            spawned, since a process with torch's threads or CUDA can't be forked safely.
    """
    processes = workers if workers > 1 else 0
    return BatchLoader(
        dataset,
        batch_sampler=batches,
        num_workers=processes,
        worker_init_fn=_start_worker,
        multiprocessing_context="spawn" if processes else None,
        persistent_workers=processes > 0,
        pin_memory=torch.cuda.is_available(),
    )


def keep_freed_memory() -> None:
    """Have this process keep the memory of one sample for the next; the loader's workers do.

    The C library otherwise gives large arrays back to the kernel as soon as they are freed, which then clears
    their pages for the next sample: a third of the time that large images take. Does nothing where the C
    library is not GNU's.
    """
    mallopt = getattr(ctypes.CDLL(None), "mallopt", None) if sys.platform == "linux" else None
    if mallopt is not None:
        mallopt(_M_MMAP_THRESHOLD, _LARGEST_KEPT)
        mallopt(_M_TRIM_THRESHOLD, _MOST_KEPT)


def _start_worker(worker: int) -> None:
    """One thread of OpenCV's in each worker: they share the machine's cores."""
    del worker
    cv2.setNumThreads(1)
    keep_freed_memory()
