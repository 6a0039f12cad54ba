"""The commands that make what a shard lacks, as error messages name them."""

from pathlib import Path

from ogmkit.homography.methods import METHODS

FULL_BODY = "full-body"

_PROJECTED = "-project"
_NETWORK = "network"


def homography_command(out: Path, source: str) -> str:
    """The command that adds a source of homographies to a folder of shards."""
    if is_network(source):
        return f"ogmkit predict homography {out} --checkpoint RUN"
    return f"ogmkit homography-fit {out} --method {source}"


def footprints_command(out: Path, name: str) -> str:
    """The command that adds a set of footprints of this name to a folder of shards."""
    return f"ogmkit render-footprints {out} {_options(name)}"


def _options(name: str) -> str:
    if name == FULL_BODY:
        return "--method full-body"
    source = name.removesuffix(_PROJECTED)
    if source not in METHODS and not is_network(source):
        return f"--masks {name}"
    return f"--method {'warp' if name == source else 'project'} --homography {source}"


def is_network(source: str) -> bool:
    """Whether a source of homographies is a network's, by its name: `network` or `network-…`."""
    return source == _NETWORK or source.startswith(f"{_NETWORK}-")
