"""The grid as options of `ogmkit extract`."""

from __future__ import annotations

import functools
from typing import TYPE_CHECKING, Any

import click

from ogmkit.grid import GridSpec, default_ego

from .record_options import Function, setting_options

if TYPE_CHECKING:
    from collections.abc import Callable


def grid_options(function: Function) -> Function:
    """Options of the grid, handed to the command as one `grid: GridSpec`."""

    @functools.wraps(function)
    def with_grid(
        *args: object,
        m_per_cell: float,
        rows: int,
        columns: int,
        ego_row: float | None,
        ego_column: float | None,
        **kwargs: object,
    ) -> object:
        row, column = default_ego(rows, columns)
        row = row if ego_row is None else ego_row
        column = column if ego_column is None else ego_column
        return function(*args, grid=GridSpec(m_per_cell, rows, columns, row, column), **kwargs)

    with_ego = functools.reduce(lambda found, option: option(found), reversed(_EGO), with_grid)
    return setting_options(GridSpec)(with_ego)  # type: ignore[return-value]  # but for `grid`


_EGO: tuple[Callable[[Any], Any], ...] = (
    click.option(
        "--ego-row",
        type=float,
        show_default="ROWS, the bottom edge",
        help="The ego's place from the grid's top edge, in cells.",
    ),
    click.option(
        "--ego-column",
        type=float,
        show_default="6/11 of COLUMNS, as in the paper",
        help="The ego's place from the grid's left edge, in cells.",
    ),
)
