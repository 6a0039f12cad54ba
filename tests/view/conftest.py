"""Recordings, read back as Rerun's own reader does."""

from collections import defaultdict

import pytest


@pytest.fixture(scope="session")
def rerun():
    return pytest.importorskip("rerun", reason="rerun-sdk is not installed: pip install 'ogmkit[view]'")


@pytest.fixture(scope="session")
def read_back(rerun):
    """Place → component → rows of (frame, time in ns, value), in the order of time; static ones have no stamp.

    `read_back(path)` of a recording; a value is what Arrow has as Python's.
    """
    from rerun.chunk import RrdReader

    def read(path):
        reader = RrdReader(path)
        assert len(reader.recordings()) == len(reader.blueprints()) == 1
        found = defaultdict(lambda: defaultdict(list))
        for chunk in reader.store().stream().collect().stream():
            batch = chunk.to_record_batch()
            columns = dict(zip(batch.schema.names, batch.columns, strict=True))
            count = batch.num_rows
            stamps = [(None, None)] * count
            if not chunk.is_static:
                frames, times = (columns[name].cast("int64").to_pylist() for name in ("frame", "time"))
                stamps = list(zip(frames, times, strict=True))
            for name, column in columns.items():
                if ":" in name and not name.startswith("rerun"):
                    rows = zip(stamps, column.to_pylist(), strict=True)
                    found[chunk.entity_path][name].extend((*stamp, value) for stamp, value in rows)
        for components in found.values():
            for rows in components.values():
                rows.sort(key=lambda row: (row[1] is not None, row[1]))
        return found

    return read


@pytest.fixture(scope="session")
def recorded(rerun, sample_shards, tmp_path_factory, read_back):
    """The sample shards, recorded and read back."""
    from ogmkit.view.view import view

    path = tmp_path_factory.mktemp("recorded") / "samples.rrd"
    assert view(sample_shards, path) == 16
    return read_back(path)
