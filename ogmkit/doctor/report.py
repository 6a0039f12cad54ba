"""All findings in one record."""

from dataclasses import dataclass

from ogmkit import __version__
from ogmkit.doctor.decoders import Decoder, decoders
from ogmkit.doctor.machine import Cache, Disk, Machine, cache, disks, machine
from ogmkit.doctor.packages import CORE, Lack, Package, lacks, packages


@dataclass(frozen=True)
class Report:
    """What this installation has and lacks.

    Attributes:
        ogmkit: its release.
        machine: what it runs on.
        packages: what it asks for.
        decoders: how files are read.
        disks: where files go.
        cache: decoded map masks.
        lacks: what is missing for what.
    """

    ogmkit: str
    machine: Machine
    packages: tuple[Package, ...]
    decoders: tuple[Decoder, ...]
    disks: tuple[Disk, ...]
    cache: Cache
    lacks: tuple[Lack, ...]

    @property
    def sound(self) -> bool:
        """Whether the core has all that it needs, and reads what it must."""
        return not any(one.extra == CORE for one in self.lacks) and not any(
            one.problem for one in self.decoders
        )


def examine() -> Report:
    """Look at this installation; nothing is written and nothing is fetched."""
    found = packages()
    return Report(__version__, machine(), found, decoders(), disks(), cache(), lacks(found))
