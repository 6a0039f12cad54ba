"""What stands in the way on real images: experiments beside `real.py`, each with one thing changed.

`python benchmarks/real_limits.py --train scene-0103 --test scene-0523`; runs and shards are shared with
`real.py`, what is there is kept. All networks are `footprints` from the start `both`:

- `as in real.py`: taught by the training scenes, reported on the whole test scene;
- `seen vehicles`: vehicles without a LiDAR point neither teach nor count;
- `images of …`: the real images at another size;
- `second half`: the first network, reported on the last frames of the test scene alone;
- `same street`: the same frames, after a training that the first ones of that scene were part of, too.

Nothing is chosen by them.
"""

import json
from dataclasses import dataclass, replace
from functools import cached_property

from limits_tables import summary
from real import Sizes, parser_of, tell
from real_parts import Part, Way
from real_shards import half_names, real_shards, write_splits
from real_trainings import Trainer, imagenet_weights, last

from ogmkit.evaluation.formats import as_json
from ogmkit.shards.settings import ExtractSettings
from ogmkit.target_settings import TargetSettings

SYSTEM, START, CONTROL = "footprints", "both", "mean-mask"
BENCHMARK, SEEN, HALF, STREET = "as in real.py", "seen vehicles", "second half", "same street"
IMAGE_SIZES = ("112x200", "448x800")


@dataclass(frozen=True)
class Experiment(Way):
    """One way round, with a thing changed.

    Attributes:
        name: of the experiment.
        scenes: whose frames these are, where `train` and `test` name halves; they are halved.
        settings: of the extraction, where they aren't the defaults.
        taught: the way whose networks are reported; None for its own.
    """

    name: str = BENCHMARK
    scenes: tuple = ()
    settings: ExtractSettings | None = None
    taught: Way | None = None

    @cached_property
    def shards(self):
        """Of all its scenes."""
        scenes = sorted(self.scenes or (*self.train, *self.test))
        return real_shards(self.folder, self.data, scenes, settings=self.settings, halved=self.scenes)

    @cached_property
    def splits(self):
        """Which of them are for what."""
        marks = [] if self.settings is None else [self.settings]
        return write_splits(self.folder, self.train, self.test, *marks)

    def records(self, seed):
        """Figures of a network, and of the control that knows the same scenes."""
        return self.part(f"{self.name.replace(' ', '-')}-{seed}", lambda: self._compared(seed))

    def _compared(self, seed):
        way = self.taught or self
        run = last(way.trainer.real(SYSTEM, START, seed, way.shards, way.splits))
        found = self._evaluated([run], ceilings=[])
        names = {found.systems[0]: SYSTEM, CONTROL: CONTROL}
        rows = [one for one in json.loads(as_json(found)) if one["system"] in names]
        rows = [one | {"system": names[one["system"]], "experiment": self.name} for one in rows]
        return Part([*self._marked(rows, START, seed)])


class Continued(Trainer):
    """Trains at another size of images, from the synthetic runs of another trainer."""

    def __init__(self, trainer, image_size):
        super().__init__(trainer.folder, replace(trainer.sizes, image_size=image_size), trainer.weights)
        self._before = trainer

    def synthetic(self, system, start):
        """The other's."""
        return self._before.synthetic(system, start)


def experiments(data, trainer, train, test):
    """All of one way round; what needs no training of its own first."""
    folder, scenes = trainer.folder, (*train, *test)
    first, second = (tuple(names) for names in zip(*map(half_names, test), strict=True))
    plain = Experiment(data, folder, trainer, train, test)
    yield plain
    yield Experiment(data, folder, trainer, train, second, HALF, scenes, taught=plain)
    yield Experiment(data, folder, trainer, (*train, *first), second, STREET, scenes)
    seen = ExtractSettings(TargetSettings(min_lidar_points=1))
    yield Experiment(data, folder, trainer, train, test, SEEN, settings=seen)
    for size in IMAGE_SIZES:
        yield Experiment(data, folder, Continued(trainer, size), train, test, f"images of {size}")


def main(arguments=None):
    parser = parser_of(__doc__, seeds=1)
    parser.add_argument("--train", action="append", required=True, metavar="SCENE")
    parser.add_argument("--test", action="append", required=True, metavar="SCENE")
    tell(parser.parse_args(arguments), records_of, summary)


def records_of(options, folder):
    """The records of every experiment, seed by seed."""
    trainer = Trainer(folder, Sizes(), imagenet_weights(None))
    ways = [*experiments(options.data, trainer, tuple(options.train), tuple(options.test))]
    return [one for seed in range(options.seeds) for way in ways for one in way.records(seed)]


if __name__ == "__main__":
    main()
