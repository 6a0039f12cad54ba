import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from ogmkit.raster.ranges import ranges

RUNS = st.lists(st.tuples(st.integers(-1000, 1000), st.integers(0, 20)), max_size=30)


@given(RUNS)
def test_runs_follow_each_other(runs):
    first, counts = np.array(runs, dtype=np.int64).reshape(-1, 2).T
    expected = [value for start, count in runs for value in range(start, start + count)]
    assert ranges(first, counts).tolist() == expected
