"""The bird's-eye-view grid: the one home of the cell convention (design.md §1)."""

from dataclasses import dataclass

import numpy as np

from ogmkit.base.stated import require_stated, setting
from ogmkit.errors import SettingsError
from ogmkit.typing import FloatArray

_MAX_CELLS = 1 << 28
_MAX_EGO_CELLS = 1e9


def default_ego(rows: int, columns: int) -> tuple[float, float]:
    """(row, column) of the ego, in cells from the top left corner, where nothing else is said.

    It stands on the bottom edge, at 6/11 of the width, as in the paper's 1000 × 550 (design.md §1).
    """
    return float(rows), columns * 6 / 11


@dataclass(frozen=True)
class GridSpec:
    """A grid of square cells on the plane z = 0 of the level frame; x forward is up, y left is left.

    The ego stands at `ego_row`, `ego_column`, counted in cells from the grid's top left *corner*; array
    indices have their integers at cell centres, half a cell further in. The default is the paper's
    1000 × 550 at 0.1 m with the ego at (1000, 300).

    Raises:
        SettingsError: a cell is not of 1e-6 to 1e6 m, the grid not of 1 to 2^28 cells, or the ego over 1e9
            cells away.
    """

    m_per_cell: float = setting(
        0.1, "Side of a grid cell.", low=1e-6, high=1e6, form="METRES", flag="--cell-size"
    )
    rows: int = setting(1000, "Rows of the grid.", low=1)
    columns: int = setting(550, "Columns of the grid.", low=1)
    ego_row: float = 1000.0
    ego_column: float = 300.0

    def __post_init__(self) -> None:
        require_stated(self)
        if self.rows * self.columns > _MAX_CELLS:
            raise SettingsError(f"grid: {self.rows} rows × {self.columns} columns are over 2^28 cells")
        for name, place in (("ego_row", self.ego_row), ("ego_column", self.ego_column)):
            if not abs(place) <= _MAX_EGO_CELLS:
                raise SettingsError(f"{name}: {place} is not within {_MAX_EGO_CELLS:g} cells")

    @property
    def shape(self) -> tuple[int, int]:
        """(rows, columns)."""
        return self.rows, self.columns

    @property
    def bev_from_level(self) -> FloatArray:
        """(3, 3) affine map from (x, y, 1) in metres, level frame, to (column, row, 1) in cells."""
        per_m = 1 / self.m_per_cell
        return np.array(
            [[0.0, -per_m, self.ego_column - 0.5], [-per_m, 0.0, self.ego_row - 0.5], [0.0, 0.0, 1.0]]
        )

    @property
    def level_from_bev(self) -> FloatArray:
        """(3, 3) affine map from (column, row, 1) in cells to (x, y, 1) in metres, level frame."""
        m = self.m_per_cell
        return np.array(
            [[0.0, -m, m * (self.ego_row - 0.5)], [-m, 0.0, m * (self.ego_column - 0.5)], [0, 0, 1]]
        )

    @property
    def x_range_m(self) -> tuple[float, float]:
        """Nearest and farthest x that the grid covers, level frame."""
        return self.m_per_cell * (self.ego_row - self.rows), self.m_per_cell * self.ego_row

    @property
    def y_range_m(self) -> tuple[float, float]:
        """Rightmost and leftmost y that the grid covers, level frame."""
        return self.m_per_cell * (self.ego_column - self.columns), self.m_per_cell * self.ego_column

    def cells(self, points_level: FloatArray) -> FloatArray:
        """Cells (column, row) of points: (..., 2 or 3) metres in the level frame give (..., 2) float64."""
        matrix = self.bev_from_level
        result: FloatArray = points_level[..., :2] @ matrix[:2, :2].T + matrix[:2, 2]
        return result

    def positions_m(self, cells: FloatArray) -> FloatArray:
        """Positions (x, y) in the level frame of (..., 2) cells (column, row): the inverse of `cells`."""
        matrix = self.level_from_bev
        result: FloatArray = np.asarray(cells) @ matrix[:2, :2].T + matrix[:2, 2]
        return result
