"""Rows that are read for several scenes at once."""

import random

import numpy as np
import pytest

from ogmkit.nuscenes.ahead import ReadAhead


class Tables:
    """Has a row for each number below a scene's own, and counts scenes that are read."""

    def __init__(self):
        self.asked = []

    def arrays(self, sql, parameters):
        self.asked.append(len(parameters["rows"]))
        rows = [(scene, number) for number in range(100) for scene in parameters["rows"] if number < scene]
        scenes, numbers = np.array(rows, np.int64).reshape(-1, 2).T
        return {"scene": scenes, "number": numbers}


@pytest.fixture
def tables():
    return Tables()


@pytest.fixture
def ahead(tables):
    return ReadAhead(tables, [*range(50, 0, -1), 0], "", lambda rows: {"rows": rows})


def rows(ahead, scene):
    return ahead.rows(scene)["number"].tolist()


def test_in_order_more_and_more_are_read_at_once(tables, ahead):
    for scene in range(50, -1, -1):
        assert rows(ahead, scene) == [*range(scene)]
        assert rows(ahead, scene) == [*range(scene)]  # a second time, from memory
    assert tables.asked == [1, 2, 4, 8, 16, 16, 4]


def test_in_any_order_the_rows_are_the_scenes(tables, ahead):
    asked = random.Random(5).choices(range(51), k=200)
    assert [rows(ahead, scene) for scene in asked] == [[*range(scene)] for scene in asked]
    assert max(tables.asked) <= 4


def test_a_gap_begins_with_one_again(tables, ahead):
    for scene in (50, 49, 48, 47, 30, 29):
        rows(ahead, scene)
    assert tables.asked == [1, 2, 4, 1, 2]
