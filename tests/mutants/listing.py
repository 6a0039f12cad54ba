"""What may change: each place that cosmic-ray's operators change in the modules, and a sample of them."""

import ast
import hashlib
from dataclasses import dataclass
from pathlib import Path

from cosmic_ray.ast import ast_nodes, get_ast
from cosmic_ray.mutating import mutate_code
from cosmic_ray.plugins import get_operator, operator_names

ROOT = Path(__file__).resolve().parents[2]
MODULES = (
    "base/steps",
    "footprints/faces",
    "footprints/terrain",
    "footprints/view",
    "footprints/warp",
    "geometry/boxes",
    "geometry/camera",
    "geometry/polygons",
    "geometry/se3",
    "grid",
    "homography/dlt",
    "homography/projective",
    "metrics/bootstrap",
    "metrics/displacement",
    "metrics/gaussian",
    "metrics/iou",
    "metrics/regions",
    "metrics/separation",
    "raster/drivable",
    "raster/field_of_view",
    "raster/fill",
    "raster/lidar",
    "raster/vehicles",
    "trajectories",
)
"""What must be exact, as paths below `ogmkit` without `.py`."""

_LEAST = 4  # of each module in a sample, where it has as many


@dataclass(frozen=True)
class Mutant:
    """One change of one place.

    Attributes:
        module: as in `MODULES`.
        operator: cosmic-ray's name, for example `core/NumberReplacer`.
        occurrence: which of the operator's mutations of the module.
        line: number of the line, from 1.
        column: where in it.
        before: the line's text, stripped.
    """

    module: str
    operator: str
    occurrence: int
    line: int
    column: int
    before: str

    @property
    def name(self) -> str:
        """The operator without its provider, and which of its mutations."""
        return f"{self.operator.split('/')[1]}#{self.occurrence}"

    @property
    def place(self) -> tuple[str, int, int, str]:
        """Where it is, and of what family: of eleven operators for a `+`, one is enough."""
        return self.module, self.line, self.column, self.operator.split("/")[1].split("_")[0]

    def after(self, source: str) -> str:
        """The line's text with the change, stripped; "" where the line is gone."""
        mutated = self.mutated(source).splitlines()
        return mutated[self.line - 1].strip() if len(mutated) == len(source.splitlines()) else ""

    def mutated(self, source: str) -> str:
        """The module's source with this change."""
        return mutate_code(source, get_operator(self.operator)(), self.occurrence)


def source_of(module: str) -> Path:
    """Its path below the checkout."""
    return Path("ogmkit", module).with_suffix(".py")


def tests_of(module: str) -> Path:
    """The path of its own tests below the checkout."""
    folder, _, name = module.rpartition("/")
    return Path("tests", folder, f"test_{name}.py")


def mutants_of(module: str, source: str) -> list[Mutant]:
    """Every mutation of what a module does, by the operators that need no arguments."""
    idle, lines = _idle(source), source.splitlines()
    nodes, found = list(ast_nodes(get_ast(source))), []
    for name in operator_names():
        if get_operator(name).arguments():
            continue
        operator = get_operator(name)()
        starts = [start for node in nodes for start, _ in operator.mutation_positions(node)]
        found += [
            Mutant(module, name, occurrence, line, column, lines[line - 1].strip())
            for occurrence, (line, column) in enumerate(starts)
            if not any(first <= (line, column) < stop for first, stop in idle)
            and not lines[line - 1].startswith("*,", column)  # a signature's, no product
        ]
    return found


def _idle(source: str) -> list[tuple[tuple[int, int], tuple[int, int]]]:
    """First and last place of each annotation: to change it stops the import, and tells nothing of tests."""
    found = []
    for node in ast.walk(ast.parse(source)):
        for name in ("annotation", "returns"):
            part = getattr(node, name, None)
            if part is not None:
                found.append(((part.lineno, part.col_offset), (part.end_lineno, part.end_col_offset)))
    return found


def sample(mutants: list[Mutant], size: int, seed: int) -> list[Mutant]:
    """One mutant of each of `size` places, at least four of each module that has so many.

    A place's rank comes from its line's text, so that an edit elsewhere leaves the rest of the sample alone.
    """

    def rank(mutant: Mutant, *more: object) -> str:
        key = (seed, mutant.module, mutant.before, mutant.column, *more)
        return hashlib.sha256(repr(key).encode()).hexdigest()

    places: dict[tuple[str, int, int, str], list[Mutant]] = {}
    for mutant in mutants:
        places.setdefault(mutant.place, []).append(mutant)
    chosen = [min(group, key=lambda mutant: rank(mutant, mutant.name)) for group in places.values()]
    chosen.sort(key=lambda mutant: rank(mutant, mutant.place[-1]))
    first: list[Mutant] = []
    for module in {mutant.module for mutant in chosen}:
        first += [mutant for mutant in chosen if mutant.module == module][:_LEAST]
    rest = [mutant for mutant in chosen if mutant not in set(first)]
    kept = first + rest[: max(0, size - len(first))]
    return sorted(kept, key=lambda mutant: (mutant.module, mutant.line, mutant.column, mutant.name))
