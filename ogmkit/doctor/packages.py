"""Which releases are installed, and which of them are absent or too old."""

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from importlib import metadata
from types import MappingProxyType

CORE = ""
USES: Mapping[str, str] = MappingProxyType(
    {
        CORE: "everything",
        "train": "train, adapt, predict, run, evaluate with RUNs, ogmkit.torch",
        "pretrained": "networks that begin with EfficientNet-Lite weights",
        "parquet": "export-shards --format parquet and hf",
        "onnx": "export",
        "view": "view",
        "cluster": "--scheduler",
        "remote": "shards in an object store, s3://BUCKET/FOLDER",
    }
)
"""Extra → what it is needed for; those of development are left out."""

_REQUIREMENT = re.compile(r"(?P<name>[\w.-]+)\s*(?P<bound>[^;]*)(?:;.*extra == ['\"](?P<extra>[\w-]+)['\"])?")


@dataclass(frozen=True)
class Package:
    """A package that ogmkit asks for.

    Attributes:
        name: as it is installed by.
        installed: its release; None where it is absent.
        asked: bounds, such as `>=1.26`.
        extra: that brings it; empty for the core.
        sound: whether it is there and not too old.
    """

    name: str
    installed: str | None
    asked: str
    extra: str
    sound: bool


@dataclass(frozen=True)
class Lack:
    """What an extra lacks.

    Attributes:
        extra: its name; empty for the core.
        packages: names.
        uses: what can't be done without them.
        remedy: the command that installs them.
    """

    extra: str
    packages: tuple[str, ...]
    uses: str
    remedy: str


def packages() -> tuple[Package, ...]:
    """The packages of the core and of the extras for use; none where ogmkit itself is not installed."""
    try:
        stated = metadata.requires("ogmkit") or []
    except metadata.PackageNotFoundError:
        return ()
    return tuple(found for one in stated if (found := package_of(one)).extra in USES)


def package_of(requirement: str) -> Package:
    """A package by a line of the metadata, such as `torch>=2.5; extra == "train"`."""
    match = _REQUIREMENT.match(requirement)
    name, bound, extra = match.group("name", "bound", "extra") if match else (requirement, "", None)
    asked = bound.strip(" ()")
    installed = _installed(name)
    return Package(
        name, installed, asked, extra or CORE, installed is not None and satisfies(installed, asked)
    )


def satisfies(installed: str, asked: str) -> bool:
    """Whether a release is not below the least one of bounds such as `>=1.26,<3`; suffixes don't count."""
    least = re.search(r">=\s*([\d.]+)", asked)
    return least is None or _numbers(installed) >= _numbers(least[1])


def lacks(found: Iterable[Package]) -> tuple[Lack, ...]:
    """What is missing for what, an extra each."""
    missing: dict[str, list[str]] = {}
    for package in found:
        if not package.sound:
            missing.setdefault(package.extra, []).append(package.name)
    return tuple(
        Lack(
            extra, tuple(names), USES[extra], f"pip install --upgrade 'ogmkit{f'[{extra}]' if extra else ''}'"
        )
        for extra, names in missing.items()
    )


def _installed(name: str) -> str | None:
    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:
        return None


def _numbers(release: str) -> tuple[int, ...]:
    """Whole numbers at the beginning of a release, without trailing zeros."""
    leading = re.match(r"\d+(\.\d+)*", release)
    numbers = [int(part) for part in leading[0].split(".")] if leading else []
    while numbers and not numbers[-1]:
        numbers.pop()
    return tuple(numbers)
