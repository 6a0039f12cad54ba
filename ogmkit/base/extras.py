"""Packages beyond the core, which an extra of the installation brings."""

import importlib.util
from collections.abc import Iterable

from ogmkit.errors import MissingPackageError


def require_packages(extra: str, packages: Iterable[str]) -> None:
    """Refuse to continue without the packages of an extra.

    Args:
        extra: its name, such as `train`.
        packages: names as they are imported.

    Raises:
        MissingPackageError: one is absent; says how to install it.
    """
    for name in packages:
        if importlib.util.find_spec(name) is None:
            raise MissingPackageError(f"needs {name}, which is not installed: pip install 'ogmkit[{extra}]'")
