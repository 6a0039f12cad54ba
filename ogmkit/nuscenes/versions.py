"""Which folder of a dataset holds its tables."""

from pathlib import Path

from ogmkit.errors import SettingsError, TableError

_A_TABLE = "scene.json"


def find_version(root: Path, version: str | None) -> str:
    """The version folder to read: the one asked for, or the only `v1.0-*` there is.

    Raises:
        SettingsError: the version asked for is absent, or several are there and none was asked for.
        TableError: the root is not a folder, or holds no version folder.
    """
    if not root.is_dir():
        raise TableError(f"{root}: no such folder; give the dataset's root, which holds v1.0-… and samples/")
    found = _versions(root)
    if version is not None:
        if version in ("", ".", "..") or "/" in version or not (root / version).is_dir():
            there = ", ".join(found or _with_tables(root)) or "none"
            raise SettingsError(f"{root}: has no version {version!r}; there are: {there}")
        return version
    if not found:
        raise TableError(f"{root}: holds no v1.0-… folder with tables; {_remedy(root)}")
    if len(found) > 1:
        raise SettingsError(f"{root}: holds several versions ({', '.join(found)}); choose one with --version")
    return found[0]


def _versions(root: Path) -> list[str]:
    return sorted(path.name for path in root.glob("v1.0-*") if path.is_dir())


def _with_tables(root: Path) -> list[str]:
    return sorted(path.parent.name for path in root.glob(f"*/{_A_TABLE}"))


def _remedy(root: Path) -> str:
    """What to do where a root has no version folder, by what lies around."""
    if (root / _A_TABLE).is_file():
        here = root.resolve()
        return f"it is a folder of tables itself: give {here.parent}, with --version {here.name}"
    if others := _with_tables(root):
        return f"{others[0]}/ holds tables: choose it with --version {others[0]}"
    deeper = sorted(path.parent for path in root.glob("*/v1.0-*") if path.is_dir())
    if deeper:
        return f"they lie one folder deeper: give {deeper[0]}"
    return "give the dataset's root"
