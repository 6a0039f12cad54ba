"""What can be wrong with a map mask's file, and what to do then."""

from dataclasses import dataclass
from pathlib import Path

from ogmkit.errors import DataFileError

_RESTORE = "restore it, or extract with --no-map"
_CONVERT = "convert it to an 8-bit greyscale PNG, or extract with --no-map"
_MAX_SIDE = 1 << 20


@dataclass(frozen=True)
class Limit:
    """How large a mask may be.

    Attributes:
        kind: of the file.
        pixels: at most.
    """

    kind: str
    pixels: int

    def require(self, path: Path, width: int, height: int) -> None:
        """Refuse a mask whose pixels would take too much memory.

        Raises:
            DataFileError: it is larger.
        """
        if max(width, height) > _MAX_SIDE or width * height > self.pixels:
            raise unsuitable(
                path,
                f"is a {self.kind} of {width} × {height} pixels, over "
                f"2^{self.pixels.bit_length() - 1} in all or 2^20 a side",
            )


def unreadable(path: Path, error: OSError) -> DataFileError:
    """The system refuses to read it."""
    return _fault(path, f"can't be read ({error.strerror})", _RESTORE, "map mask can't be read")


def not_whole(path: Path, form: str, error: Exception) -> DataFileError:
    """It is damaged."""
    return _fault(path, f"is not a whole {form} ({error})", _RESTORE, "map mask is damaged")


def cut_short(path: Path) -> DataFileError:
    """Its end is missing."""
    return _fault(path, "is cut short", _RESTORE, "map mask is damaged")


def not_fetched(path: Path) -> DataFileError:
    """It only stands for a file that git-LFS has not fetched."""
    return _fault(path, "is a git-LFS pointer", "run git lfs pull", "map mask is absent")


def unsuitable(path: Path, what: str) -> DataFileError:
    """It is whole, but of a form that can't be read as a mask."""
    return _fault(path, what, _CONVERT, "map mask has another form")


def is_vector_map(path: Path) -> bool:
    """Whether a map's file is not a picture but a JSON file of the map expansion, by its name."""
    return path.suffix.lower() == ".json"


def refuse_vector_map(path: Path) -> None:
    """Refuse a vector map, whether or not it is there.

    Raises:
        DataFileError: it is one.
    """
    if is_vector_map(path):
        raise DataFileError(
            f"{path}: is a vector map of the map expansion; ogmkit needs the mask PNG, or --no-map",
            kind="map is a vector map",
        )


def _fault(path: Path, what: str, remedy: str, kind: str) -> DataFileError:
    return DataFileError(f"{path}: map mask {what}; {remedy}", kind=kind)
