"""Tokens of frames by scene and camera, of all scenes at once."""

from collections.abc import Sequence

from ogmkit.nuscenes.rules import CONCERNS
from ogmkit.nuscenes.soundness import Soundness
from ogmkit.nuscenes.tables import Tables

_TOKENS = f"""
SELECT s.name, k.channel, list(k.token ORDER BY k.sample_timestamp)
FROM key_frame k
JOIN (
    SELECT any_value(token) AS token, coalesce(name, token) AS name FROM scene
    GROUP BY 2 HAVING count(*) = 1
) s ON s.token = k.scene
WHERE list_contains($channels, k.channel)
  AND k.scene NOT IN (SELECT scene FROM violation WHERE scene IS NOT NULL AND {CONCERNS})
GROUP BY s.name, k.channel
"""


def read_frame_tokens(
    tables: Tables, soundness: Soundness, channels: Sequence[str], *, maps: bool
) -> dict[str, dict[str, tuple[str, ...]]]:
    """Scene → channel → tokens in temporal order, of scenes that have all channels and break no rule.

    Args:
        tables: of the dataset.
        soundness: of its scenes.
        channels: of cameras and LiDAR.
        maps: whether rules on maps count.
    """
    if maps and soundness.no_maps is not None:
        return {}
    soundness.find()
    found: dict[str, dict[str, tuple[str, ...]]] = {}
    for name, channel, tokens in tables.rows(_TOKENS, {"channels": [*channels], "maps": maps}):
        found.setdefault(name, {})[channel] = tuple(tokens)
    return {name: by_channel for name, by_channel in found.items() if len(by_channel) == len(channels)}
