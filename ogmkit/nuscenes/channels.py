"""Channels of sensors."""

from ogmkit.nuscenes.tables import Tables

_CHANNELS = """
SELECT DISTINCT modality, channel FROM sensor
WHERE modality IS NOT NULL AND channel IS NOT NULL ORDER BY channel
"""


def read_channels(tables: Tables) -> dict[str, tuple[str, ...]]:
    """Modality → channel names, sorted."""
    found: dict[str, tuple[str, ...]] = {}
    for modality, channel in tables.rows(_CHANNELS):
        found[modality] = (*found.get(modality, ()), channel)
    return found
