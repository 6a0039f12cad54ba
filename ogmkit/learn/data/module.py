"""Training and validation data of a folder of shards, as Lightning takes them."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from lightning import LightningDataModule
from torch import Tensor

from ogmkit.learn.data.augment import Augmentation
from ogmkit.learn.data.frames import FrameDataset
from ogmkit.learn.data.loader import BatchLoader, EpochBatches, loader
from ogmkit.learn.data.sequences import SequenceDataset
from ogmkit.learn.data.tensors import as_float
from ogmkit.samples.index import index_frames, index_sequences
from ogmkit.samples.poses import require_finite_poses
from ogmkit.samples.spec import SampleSpec


@dataclass(frozen=True)
class Loading:
    """How samples are read in training.

    Attributes:
        batch_size: samples of a batch, on each device.
        workers: number of processes that read ahead, for each of the two loaders.
        seed: of order and augmentation.
        augmentation: of training samples; None leaves them as they are.
    """

    batch_size: int = 8
    workers: int = 0
    seed: int = 0
    augmentation: Augmentation | None = None


class ShardDataModule(LightningDataModule):
    """Frames, or sequences, of training and validation scenes; both leave out what lacks something valid.

    Its loaders divide the batches among devices by themselves: the trainer needs
    `use_distributed_sampler=False`.

    Args:
        out: a folder that `ogmkit extract` wrote.
        train: names of scenes.
        val: names of scenes.
        cameras: channels; none stands for all of the folder's.
        spec: what samples hold.
        loading: how they are read.
        limit_frames: most samples of either set, evenly spread; None takes all.
        sequences: whether samples are sequences of six images instead of frames.

    Attributes:
        train_set: training samples.
        val_set: validation samples.
        train_batches: order of the training's batches; set its `epoch` and `skip` to resume in mid-epoch.
        val_batches: order of the validation's batches.

    Raises:
        SettingsError, ShardError, TrainingError: see `index_frames`, `index_sequences`, `FrameDataset` and
            `EpochBatches`.
    """

    def __init__(
        self,
        out: Path,
        train: Sequence[str],
        val: Sequence[str],
        cameras: Sequence[str],
        spec: SampleSpec,
        *,
        loading: Loading,
        limit_frames: int | None = None,
        sequences: bool = False,
    ) -> None:
        super().__init__()
        self._loading = loading
        find, samples = (index_sequences, SequenceDataset) if sequences else (index_frames, FrameDataset)
        train_index, val_index = (
            find(out, scenes, cameras, needs=spec, limit=limit_frames) for scenes in (train, val)
        )
        if sequences:
            require_finite_poses(train_index)
            require_finite_poses(val_index)
        self.train_set = samples(train_index, spec, augment=loading.augmentation, compact=True)
        self._train_index, self._samples = train_index, samples
        self.val_set = samples(val_index, spec, compact=True)
        self.train_batches = self._batches(self.train_set, shuffle=True)
        self.val_batches = self._batches(self.val_set, shuffle=False)

    def train_dataloader(self) -> BatchLoader:
        """Training batches, shuffled and augmented."""
        return self._loader(self.train_set, self.train_batches)

    def statistics(self, spec: SampleSpec, rounds: int) -> Iterator[dict[str, Tensor]]:
        """Batches of training samples in order, augmented as in training, for what is fixed before it.

        Args:
            spec: what samples hold.
            rounds: how often each is drawn; where nothing moves it, once.
        """
        augment = self._loading.augmentation
        samples = self._samples(self._train_index, spec, augment=augment, compact=True)
        batches = EpochBatches(len(samples), self._loading.batch_size, seed=self._loading.seed, shuffle=False)
        for batches.epoch in range(rounds if augment is not None and augment.moves else 1):
            yield from map(as_float, loader(samples, batches, workers=0))

    def val_dataloader(self) -> BatchLoader:
        """Validation batches, in order."""
        return self._loader(self.val_set, self.val_batches)

    def _batches(self, dataset: FrameDataset, *, shuffle: bool) -> EpochBatches:
        return EpochBatches(len(dataset), self._loading.batch_size, seed=self._loading.seed, shuffle=shuffle)

    def _loader(self, dataset: FrameDataset, batches: EpochBatches) -> BatchLoader:
        if self.trainer is not None:
            batches.rank, batches.world = self.trainer.global_rank, self.trainer.world_size
        return loader(dataset, batches, workers=self._loading.workers)
