"""The commands that make what a shard lacks, as error messages name them."""

from pathlib import Path

from ogmkit.footprints.sets import FULL_BODY, mask_kind
from ogmkit.homography.sources import is_network


def homography_command(out: Path, source: str) -> str:
    """The command that adds a source of homographies to a folder of shards."""
    if is_network(source):
        return f"ogmkit predict homography {out} --checkpoint RUN"
    return f"ogmkit homography-fit {out} --method {source}"


def footprints_command(out: Path, name: str) -> str:
    """The command that adds a set of footprints of this name to a folder of shards."""
    return f"ogmkit render-footprints {out} {_options(name)}"


def _options(name: str) -> str:
    found = mask_kind(name)
    if found is None:
        return f"--masks {name}"
    options = f"--method {found.method}"
    return options if found.method == FULL_BODY else f"{options} --homography {found.homography}"
