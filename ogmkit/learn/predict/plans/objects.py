"""Plans as JSON: an object a plan, drawn from where asked, written one after the other."""

import json
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ogmkit.base.atomic import replacing
from ogmkit.errors import SettingsError
from ogmkit.metrics.plan import Plan
from ogmkit.typing import FloatArray

PlanObject = Mapping[str, object]
"""What a JSON object holds."""


@dataclass(frozen=True)
class PlanJob:
    """What is asked for, whatever it is planned from.

    Attributes:
        checkpoint: a RUN of a planner, or one of its checkpoints.
        samples: trajectories to draw from each plan.
        seed: of what is drawn.
        batch_size: sequences at a time.
        workers: processes that read; 0 reads in the calling one.

    Raises:
        SettingsError: a number is negative.
    """

    checkpoint: Path
    samples: int = 0
    seed: int = 0
    batch_size: int = 8
    workers: int = 0

    def __post_init__(self) -> None:
        for name in ("samples", "seed"):
            if getattr(self, name) < 0:
                raise SettingsError(f"{name}: {getattr(self, name)} is negative")

    def generator(self) -> np.random.Generator:
        """A new source of what is drawn."""
        return np.random.default_rng(self.seed)


@dataclass(frozen=True, eq=False)
class PlanStream:
    """Plans, made one after the other while they are read.

    Attributes:
        name: the run's, such as `holistic-np`.
        homography: where those come from that masks are warped by; None where none takes part.
        count: how many objects there are.
        objects: of the plans.
    """

    name: str
    homography: str | None
    count: int
    objects: Iterator[PlanObject]


def plan_object(
    plan: Plan, destination: FloatArray | None, step_s: float, samples: int, generator: np.random.Generator
) -> dict[str, object]:
    """What is said of a plan.

    Args:
        plan: of finite numbers.
        destination: (2,) metres, level frame; None where the planner is not told it.
        step_s: time from one point to the next.
        samples: trajectories to draw.
        generator: of what is drawn.

    Returns:
        `destination` where it is told, `plan` (a point each step) and, where trajectories are drawn,
        `samples`; metres and seconds, plain numbers and lists.
    """
    points = [
        {
            "t_s": round(step_s * (step + 1), 6),
            "x": x,
            "y": y,
            "sigma_x": sigma_x,
            "sigma_y": sigma_y,
            "rho": rho,
        }
        for step, ((x, y), (sigma_x, sigma_y), rho) in enumerate(
            zip(plan.mean.tolist(), plan.sigma.tolist(), plan.rho.tolist(), strict=True)
        )
    ]
    told = {} if destination is None else {"destination": destination.tolist()}
    found: dict[str, object] = {**told, "plan": points}
    if samples:
        found["samples"] = drawn(plan, samples, generator).tolist()
    return found


def drawn(plan: Plan, samples: int, generator: np.random.Generator) -> FloatArray:
    """Draw trajectories: (N, T, 2) float64 metres, level frame.

    Each point comes from its own step's Gaussian, whatever the point before: a plan says nothing of how steps
    hang together, so a drawn trajectory is less smooth than a driven one.
    """
    first, second = np.moveaxis(generator.standard_normal((samples, *plan.mean.shape)), -1, 0)
    # The Cholesky factor of the correlation matrix of x and y.
    units = np.stack([first, plan.rho * first + np.sqrt(1 - plan.rho**2) * second], axis=-1)
    points: FloatArray = plan.mean + plan.sigma * units
    return points


def json_list(objects: Iterable[PlanObject]) -> Iterator[str]:
    """Parts of the text of a JSON list, an object a line; the first part comes with the first object."""
    start = "["
    for one in objects:
        yield start + json.dumps(one, allow_nan=False)
        start = ",\n"
    yield "[]\n" if start == "[" else "]\n"


def write_list(path: Path, objects: Iterable[PlanObject]) -> None:
    """Write a JSON list, whole or not at all; a file of the same name is replaced.

    Raises:
        OutputError: the disk is full or refuses otherwise.
    """
    with replacing(path) as part, part.open("w", encoding="utf-8") as file:
        file.writelines(json_list(objects))
