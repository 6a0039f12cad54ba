"""Settings in YAML files."""

from pathlib import Path
from typing import Any, Protocol

from ogmkit.base.files import read_text
from ogmkit.errors import CheckpointError

_MAX_BYTES = 1 << 20


class Plain(Protocol):
    """What can be told in plain JSON values."""

    def to_dict(self) -> dict[str, Any]:
        """Those values."""


def as_yaml(settings: Plain) -> str:
    """Settings as a YAML file has them."""
    import yaml  # noqa: PLC0415  # comes with the extra `train`

    text: str = yaml.safe_dump(settings.to_dict(), sort_keys=False, allow_unicode=True)
    return text


def read_yaml(path: Path) -> dict[str, Any]:
    """The mapping in a YAML file.

    Raises:
        CheckpointError: it is absent, too large, no YAML, or no mapping.
    """
    import yaml  # noqa: PLC0415  # comes with the extra `train`

    try:
        content = yaml.safe_load(read_text(path, _MAX_BYTES))
    except OSError as error:
        raise CheckpointError(f"{path}: can't be read ({error.strerror}); choose another file") from error
    except RecursionError as error:
        raise CheckpointError(f"{path}: is nested too deeply for settings; correct it") from error
    except (yaml.YAMLError, ValueError) as error:
        reason = " ".join(str(error).split())
        raise CheckpointError(f"{path}: not YAML ({reason}); correct it") from error
    if not isinstance(content, dict) or not all(isinstance(key, str) for key in content):
        raise CheckpointError(f"{path}: not a mapping of setting: value; correct it")
    return content
