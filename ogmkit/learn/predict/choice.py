"""Which frames of a folder of shards are predicted; free of torch, so that a wrong name is found at once."""

from dataclasses import dataclass
from pathlib import Path

from ogmkit.base.names import matching, unknown
from ogmkit.errors import SettingsError
from ogmkit.learn.runs import checkpoint_file
from ogmkit.pipeline.amendment import chosen_cameras
from ogmkit.samples.splits import split_scenes
from ogmkit.shards.manifest import Manifest, read_manifest


@dataclass(frozen=True)
class Choice:
    """Which frames of a folder of shards.

    Attributes:
        scenes: names, or patterns such as `scene-00*`; none means all.
        splits: only the scenes of these; none means no such limit.
        split_file: where the splits stand; the manifest by default.
        cameras: channels; none means all that the run knows.
        limit: frames at most, evenly spread; None for all.
    """

    scenes: tuple[str, ...] = ()
    splits: tuple[str, ...] = ()
    split_file: Path | None = None
    cameras: tuple[str, ...] = ()
    limit: int | None = None

    def scenes_of(self, shards: Path, manifest: Manifest) -> tuple[str, ...]:
        """The chosen scenes, in the manifest's order.

        Raises:
            SettingsError: a scene or split is unknown, a pattern matches none, or no scene is left.
            TableError: the split file is absent or malformed.
        """
        present = tuple(entry.scene for entry in manifest.shards)
        chosen = set(matching("scene", self.scenes, present, shards))
        if self.splits:
            known = split_scenes(manifest, split_file=self.split_file)
            for split in self.splits:
                if split not in known:
                    raise SettingsError(f"{shards}: {unknown('split', split, tuple(known))}")
            chosen &= {name for split in self.splits for name in known[split]}
        if not chosen:
            raise SettingsError(f"{shards}: none of the chosen scenes is in split {', '.join(self.splits)}")
        return tuple(name for name in present if name in chosen)


def require_predictable(checkpoint: Path, shards: Path, choice: Choice) -> None:
    """Check what a prediction needs, as far as the manifest says; reads neither weights nor frames.

    Args:
        checkpoint: a RUN folder or a checkpoint.
        shards: a folder that an extraction finished.
        choice: which frames.

    Raises:
        CheckpointError: the checkpoint is missing.
        ShardError: the folder is not a finished extraction.
        SettingsError: a scene, split or camera is unknown, or no scene is left.
        TableError: the split file is absent or malformed.
    """
    checkpoint_file(checkpoint)
    manifest = read_manifest(shards)
    choice.scenes_of(shards, manifest)
    chosen_cameras(shards, manifest, choice.cameras)
