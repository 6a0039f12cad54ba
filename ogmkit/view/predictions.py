"""What `ogmkit predict` wrote, frame by frame: masks of a folder, plans of a JSON file."""

import json
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from ogmkit.base.files import file_status, read_text
from ogmkit.errors import MALFORMED, DataFileError, SettingsError
from ogmkit.grid import GridSpec
from ogmkit.learn.predict.form import FORMAT, FORMAT_VERSION
from ogmkit.metrics.plan import Plan
from ogmkit.samples.spec import TARGETS
from ogmkit.shards.faults import H5_ERRORS, refusal
from ogmkit.typing import UInt8Array

THRESHOLD = 0.5
"""Of a probability, over which a cell or pixel is shown as set."""
_AGAIN = "run `ogmkit predict` again"

Masks = Mapping[str, UInt8Array]
"""Target → (h, w) uint8 0/1."""


@dataclass(frozen=True, eq=False)
class Predicted:
    """What is predicted of a frame.

    Attributes:
        bev: on the grid; empty where it is not predicted.
        image: in the camera's view; empty where it is not predicted.
        plan: None where there is none.
    """

    bev: Masks
    image: Masks
    plan: Plan | None


@dataclass(frozen=True)
class Place:
    """A frame of a scene.

    Attributes:
        scene: its name.
        camera: channel.
        index: the frame's place among the camera's.
        token: of the key frame.
    """

    scene: str
    camera: str
    index: int
    token: str


@dataclass(frozen=True, eq=False)
class Source:
    """What one run predicted.

    Attributes:
        name: as it is shown: the folder's or the file's, without ending.
        path: the folder of masks, or the file of plans.
        plans: (scene, camera, frame) → token and plan; None of a folder.
        grid: of the shards.
    """

    name: str
    path: Path
    plans: Mapping[tuple[str, str, int], tuple[str, Plan]] | None
    grid: GridSpec

    def has(self, scene: str) -> bool:
        """Whether it is of a scene."""
        if self.plans is None:
            return (self.path / f"{scene}.h5").exists()
        return any(scene == one for one, _, _ in self.plans)

    @contextmanager
    def opened(self, scene: str) -> Iterator["Reader"]:
        """Read a scene.

        Raises:
            DataFileError: its file is damaged, or no prediction for these shards.
        """
        if self.plans is not None or not self.has(scene):
            yield Reader(self, None, {})
            return
        path = self.path / f"{scene}.h5"
        with ExitStack() as stack:
            with _reading(path):
                file_status(path)
                h5 = stack.enter_context(h5py.File(path, "r", locking=False))
                if h5.attrs.get("format") != FORMAT or h5.attrs.get("format_version") != FORMAT_VERSION:
                    raise DataFileError(f"{path}: is no {FORMAT} of version {FORMAT_VERSION}; {_AGAIN}")
                rows = {
                    (camera, int(index)): row
                    for camera in h5
                    for row, index in enumerate(h5[camera]["frame"][:].tolist())
                }
            yield Reader(self, h5, rows)


@dataclass(frozen=True, eq=False)
class Reader:
    """A source, open for one scene.

    Attributes:
        source: what it reads.
        h5: the scene's file; None of plans, and where the source lacks the scene.
        rows: (camera, frame) → row of the file.
    """

    source: Source
    h5: h5py.File | None
    rows: Mapping[tuple[str, int], int]

    def read(self, place: Place) -> Predicted | None:
        """What is predicted of a frame; None where nothing is.

        Raises:
            DataFileError: it is damaged, or of other shards.
        """
        if self.source.plans is not None:
            known = self.source.plans.get((place.scene, place.camera, place.index))
            if known is None:
                return None
            _require_same(self.source.path, place, known[0])
            return Predicted({}, {}, known[1])
        row = self.rows.get((place.camera, place.index))
        if self.h5 is None or row is None:
            return None
        path = Path(self.h5.filename)
        with _reading(path):
            group = self.h5[place.camera]
            _require_same(path, place, group["sample_token"].asstr()[row])
            found = {name: _masks(group[name][row]) if name in group else {} for name in ("bev", "image")}
        for mask in found["bev"].values():
            if mask.shape != self.source.grid.shape:
                raise DataFileError(
                    f"{path}: {place.camera}: has masks of {mask.shape[0]} × {mask.shape[1]} cells, "
                    f"the shards {self.source.grid.rows} × {self.source.grid.columns}; choose predictions "
                    "of these shards"
                )
        return Predicted(found["bev"], found["image"], None)


def open_predictions(paths: Sequence[Path], scenes: Sequence[str], grid: GridSpec) -> tuple[Source, ...]:
    """Find what was predicted.

    Args:
        paths: folders that `ogmkit predict SYSTEM --out` wrote, and files of `ogmkit predict plan --out`.
        scenes: that are shown; each path must have some of them.
        grid: of the shards.

    Raises:
        DataFileError: a file of plans is absent or damaged.
        SettingsError: two have the same name, or one has none of the scenes.
    """
    sources: dict[str, Source] = {}
    for path in dict.fromkeys(paths):
        plans = None if path.is_dir() else _read_plans(path)
        source = Source(path.resolve().stem if plans is not None else path.resolve().name, path, plans, grid)
        if source.name in sources:
            raise SettingsError(
                f"{path}: has the same name as {sources[source.name].path}; rename one of them"
            )
        if not any(map(source.has, scenes)):
            raise SettingsError(
                f"{path}: has predictions of none of the scenes; choose what `ogmkit predict` wrote for them"
            )
        sources[source.name] = source
    return tuple(sources.values())


def _read_plans(path: Path) -> dict[tuple[str, str, int], tuple[str, Plan]]:
    try:
        objects = json.loads(read_text(path))
        return {
            (str(one["scene"]), str(one["camera"]), int(one["frame"])): (
                str(one["sample_token"]),
                _plan(one["plan"]),
            )
            for one in objects
        }
    except OSError as error:
        raise DataFileError(f"{path}: can't be read ({error.strerror}); {_AGAIN}") from error
    except (*MALFORMED, RecursionError) as error:
        raise DataFileError(
            f"{path}: holds no plans of shards ({type(error).__name__}: {error}); "
            "choose a file of `ogmkit predict plan`"
        ) from error


def _plan(points: Sequence[Mapping[str, Any]]) -> Plan:
    def column(*names: str) -> Any:  # noqa: ANN401  # an array
        return np.array([[float(point[name]) for name in names] for point in points])

    plan = Plan(column("x", "y"), column("sigma_x", "sigma_y"), column("rho")[:, 0])
    numbers = np.concatenate([plan.mean, plan.sigma, plan.rho[:, None]], axis=1)
    if not np.isfinite(numbers).all() or (plan.sigma < 0).any() or (np.abs(plan.rho) > 1).any():
        raise ValueError("numbers that are no Gaussian")
    return plan


def _masks(probabilities: Any) -> dict[str, UInt8Array]:  # noqa: ANN401  # an array of the file
    if probabilities.ndim != len("chw") or not probabilities.size:
        raise ValueError(f"masks of shape {probabilities.shape}")
    return {
        target: (one > THRESHOLD).astype(np.uint8) for target, one in zip(TARGETS, probabilities, strict=True)
    }


def _require_same(path: Path, place: Place, token: str) -> None:
    if token != place.token:
        raise DataFileError(
            f"{path}: {place.scene}, {place.camera}, frame {place.index}: is of another key frame than in "
            "the shard; choose predictions of these shards"
        )


@contextmanager
def _reading(path: Path) -> Iterator[None]:
    try:
        yield
    except DataFileError:
        raise
    except (*H5_ERRORS, LookupError) as error:
        reason = refusal(error) or f"is damaged ({error})"
        raise DataFileError(f"{path}: {reason}; {_AGAIN}") from error
