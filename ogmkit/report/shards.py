"""What a report says of shards: read one by one, their pictures laid aside as they come."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from ogmkit.base.execution import Execution, run_over
from ogmkit.evaluation.frames import Place
from ogmkit.report.choice import frames_a_scene
from ogmkit.report.distributions import total
from ogmkit.report.homographies import collected
from ogmkit.report.part import Part, Task, read_part
from ogmkit.report.predictions import Predicted, Predictions
from ogmkit.report.section_distributions import distributions_section
from ogmkit.report.section_extracted import extracted_section, scenes_section
from ogmkit.report.section_frames import FrameData, examples_section, frames_section, pictures_html
from ogmkit.report.section_homographies import homographies_section
from ogmkit.report.section_sound import sound_section
from ogmkit.report.sections import Section
from ogmkit.report.settings import ReportSettings
from ogmkit.report.soundness import Soundness
from ogmkit.shards.manifest import Manifest

Keep = Callable[[bytes], None]
"""Takes what belongs at the end of the page."""


@dataclass(frozen=True)
class ShardFolder:
    """A folder of shards, and what is known of it before it is read.

    Attributes:
        path: the folder.
        manifest: its manifest.
        dataroot: where the dataset is; None where the report wasn't told.
        soundness: what verify and check found.
        predictions: what runs predict.
    """

    path: Path
    manifest: Manifest
    dataroot: Path | None
    soundness: Soundness
    predictions: Predictions

    @property
    def images(self) -> Path | None:
        """Where images are that the shards only refer to; None where they keep them, or there are none."""
        if self.manifest.settings.targets.images != "reference":
            return None
        root = self.dataroot or Path(self.manifest.dataroot)
        return root if root.is_dir() else None

    def frames_a_scene(self, settings: ReportSettings) -> int:
        """How many frames of a scene are pictured."""
        return frames_a_scene(len(self.manifest.shards), settings.frames, self.predictions.characters)


@dataclass(frozen=True)
class Shown:
    """What the page shows of shards.

    Attributes:
        title: of the page.
        sections: in order.
        frames: what the script reads.
    """

    title: str
    sections: tuple[Section, ...]
    frames: FrameData


def read_shards(folder: ShardFolder, settings: ReportSettings, execution: Execution, keep: Keep) -> Shown:
    """Read all shards, one at a time in each process.

    Args:
        folder: what to read.
        settings: what to show.
        execution: worker processes and progress, in shards.
        keep: gets the pictures.

    Raises:
        ShardError, DataFileError: a shard or an image is absent or damaged.
        OutputError: `keep` can't take more.
    """
    entries, most = folder.manifest.shards, folder.frames_a_scene(settings)
    numbers = {entry.scene: number for number, entry in enumerate(entries)}
    tasks = [
        Task(folder.path, entry, most, _of_scene(folder.predictions, entry.scene), folder.images)
        for entry in entries
    ]
    parts: dict[int, Part] = {}
    waiting: dict[int, bytes] = {}
    written = 0
    for done, part in enumerate(run_over(read_part, tasks, execution), start=1):
        number = numbers[part.entry.scene]
        waiting[number] = pictures_html(number, part.pictures).encode()
        parts[number] = replace(part, pictures=())
        while written in waiting:  # in the page's order, whatever the order they come in
            keep(waiting.pop(written))
            written += 1
        execution.report(done, len(tasks))
    return _shown(folder, tuple(parts[number] for number in sorted(parts)), most)


def _of_scene(predictions: Predictions, scene: str) -> Mapping[Place, tuple[Predicted, ...]]:
    return {place: found for place, found in predictions.by_frame.items() if place[0] == scene}


def _shown(folder: ShardFolder, parts: tuple[Part, ...], most: int) -> Shown:
    data = FrameData(parts)
    homographies = collected(part.homographies for part in parts)
    sections = [
        extracted_section(folder.path, folder.manifest, parts),
        sound_section(folder.soundness, parts),
        distributions_section(total(part.distributions for part in parts)),
        frames_section(data, most),
    ]
    if data.runs:
        sections.append(examples_section(data, folder.predictions.heading))
    if homographies.methods:
        sections.append(homographies_section(homographies))
    sections.append(scenes_section(parts))
    return Shown("/".join(folder.path.resolve().parts[-2:]).strip("/"), tuple(sections), data)
