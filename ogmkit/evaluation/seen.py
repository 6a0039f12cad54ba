"""Runs that have seen the scenes they are scored on: their figures say less than others' do."""

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from ogmkit.base.names import with_number
from ogmkit.learn.runs import ADAPTED, SPLITS, scenes_of
from ogmkit.samples.splits import TRAIN, VAL


@dataclass(frozen=True)
class Seen:
    """Rows whose runs have seen reported scenes; scenes are told by their names.

    Attributes:
        learnt: row → how many of the scenes its network learnt from.
        chosen: row → how many of the scenes chose its checkpoint.
        adapted: row → how many of the scenes gave its normalisation, without labels.
        unknown: rows of checkpoints that stand alone, without their training's list of scenes.
    """

    learnt: Mapping[str, int]
    chosen: Mapping[str, int]
    adapted: Mapping[str, int]
    unknown: tuple[str, ...]

    def notes(self) -> Iterator[str]:
        """Sentences to be read with the tables."""
        if self.chosen:
            yield (
                "the best checkpoint was chosen on scenes that are reported here, which flatters "
                f"{', '.join(self.chosen)}: scenes of a split test are for that"
            )
        for name, count in self.learnt.items():
            yield (
                f"{name} learnt from {with_number(count, 'scene')} of these names: no result, unless they "
                f"are of another dataset; its {SPLITS}, as --split-file, has others"
            )
        for name, count in self.adapted.items():
            scenes = with_number(count, "scene")
            yield f"{name} has its normalisation from images, without labels, of {scenes} here"
        if self.unknown:
            yield (
                f"whether {', '.join(self.unknown)} has seen these scenes is not known: there is no {SPLITS} "
                "beside the checkpoint"
            )


def seen_by(checkpoints: Mapping[str, Path], reported: Collection[str]) -> Seen:
    """Compare the scenes of trainings with those that are reported.

    Args:
        checkpoints: row → the checkpoint's file.
        reported: names of scenes.

    Raises:
        TableError: a training's list of scenes is damaged.
    """
    trainings = {name: scenes_of(checkpoint) for name, checkpoint in checkpoints.items()}
    learnt, chosen, adapted = (
        {name: len({*scenes.get(split, ())} & {*reported}) for name, scenes in trainings.items()}
        for split in (TRAIN, VAL, ADAPTED)
    )
    return Seen(
        learnt={name: count for name, count in learnt.items() if count},
        chosen={name: count for name, count in chosen.items() if count},
        adapted={name: count for name, count in adapted.items() if count},
        unknown=tuple(name for name, scenes in trainings.items() if TRAIN not in scenes),
    )
