"""Settings that differ, in words."""

from collections.abc import Mapping
from typing import Any


def differences(here: Mapping[str, Any], there: Mapping[str, Any]) -> tuple[str, ...]:
    """Names of the settings that differ, each with both values: `grid.rows is 800 here but 1000 there`."""
    flat_here, flat_there = dict(_flat(here)), dict(_flat(there))
    names = sorted(flat_here.keys() | flat_there.keys())
    return tuple(
        f"{name} is {_shown(flat_here, name)} here but {_shown(flat_there, name)} there"
        for name in names
        if flat_here.get(name) != flat_there.get(name)
    )


def _flat(values: Mapping[str, Any], prefix: str = "") -> list[tuple[str, Any]]:
    pairs = []
    for name, value in values.items():
        pairs += _flat(value, f"{prefix}{name}.") if isinstance(value, dict) else [(prefix + name, value)]
    return pairs


def _shown(flat: Mapping[str, Any], name: str) -> str:
    value = flat.get(name, "absent")
    return ",".join(map(str, value)) if isinstance(value, list) else str(value)
