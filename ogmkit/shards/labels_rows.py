"""Which samples are the rows of a definition's labels."""

from ogmkit.frames import KeyFrame, SceneRecord
from ogmkit.labels.definition import Definition
from ogmkit.shards.schema_labels import SURROUND


def rows_of(scene: SceneRecord, definition: Definition) -> tuple[KeyFrame, ...]:
    """The key frames that are a definition's rows: below a camera's group, those of the camera's frames."""
    if definition.place == SURROUND:
        return scene.key_frames
    frames = scene.cameras.get(definition.place)
    there = None if frames is None else {frame.sample_token for frame in frames}
    return tuple(
        one
        for one in scene.key_frames
        if one.camera is not None and (there is None or one.sample_token in there)
    )


def sample_tokens(scene: SceneRecord, definition: Definition) -> tuple[str, ...]:
    """Their tokens."""
    return tuple(one.sample_token for one in rows_of(scene, definition))
