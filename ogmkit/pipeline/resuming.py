"""Whether a scene's shard is what an extraction would make now, also where frames were left out."""

from pathlib import Path

from ogmkit.errors import ShardError, UnreadableShardError
from ogmkit.frames import LeftOutFrame, SceneRecord
from ogmkit.pipeline.frame_files import frame_fault, without
from ogmkit.pipeline.output import Request
from ogmkit.shards.faults import H5_ERRORS
from ogmkit.shards.left_out import left_out_frames
from ogmkit.shards.reader import Shard
from ogmkit.shards.summary import Expected, is_current


def is_up_to_date(path: Path, scene: SceneRecord, request: Request, *, read: bool = True) -> bool:
    """Whether a scene's shard is whole and as the request wants it; files of its frames are not looked at.

    Where frames may be left out, those that the shard lacks must still be bad; otherwise it is rebuilt.

    Args:
        path: the shard's file.
        scene: all frames by the tables.
        request: what is wanted.
        read: whether a frame is known to be bad by reading its files; else only by looking for them.

    Raises:
        UnreadableShardError: the system refuses to read the shard.
        DataFileError: the system refuses to read a file of a frame that was left out.
    """
    settings, version = request.settings, request.dataset_version
    if is_current(path, Expected.of(scene, settings), settings, version):
        return True
    if not settings.skip_bad_frames:
        return False
    left_out = _left_out(path, scene)
    tokens = {frame.sample_data_token for frames in left_out.values() for frame in frames}
    return (
        bool(tokens)
        and is_current(path, Expected.of(without(scene, left_out), settings), settings, version)
        and all(
            frame_fault(frame, settings.targets, read=read)
            for frames in scene.cameras.values()
            for frame in frames
            if frame.sample_data_token in tokens
        )
    )


def _left_out(path: Path, scene: SceneRecord) -> dict[str, tuple[LeftOutFrame, ...]]:
    """The frames that a shard says it lacks, by camera; none where it can't be read as a shard."""
    try:
        with Shard(path) as shard:
            return {camera: left_out_frames(shard, camera) for camera in scene.cameras}
    except UnreadableShardError:
        raise
    except (ShardError, *H5_ERRORS):
        return {}
