"""Recordings, read back as Rerun's own reader does."""

from collections import defaultdict

import pytest


@pytest.fixture(scope="session")
def rerun():
    return pytest.importorskip("rerun", reason="rerun-sdk is not installed: pip install 'ogmkit[view]'")


@pytest.fixture(scope="session")
def read_back(rerun):
    """Place → component → rows of (frame, time in ns, value), in the order of time: `read_back(path)`.

    Static ones have no stamp; a value is what Arrow has, as Python's.
    """
    from rerun.chunk import RrdReader

    def read(path):
        reader = RrdReader(path)
        assert len(reader.recordings()) == len(reader.blueprints()) == 1
        found = defaultdict(lambda: defaultdict(list))
        for chunk in reader.store().stream().collect().stream():
            batch = chunk.to_record_batch()
            columns = dict(zip(batch.schema.names, batch.columns, strict=True))
            stamps = [(None, None)] * batch.num_rows
            if not chunk.is_static:
                assert sorted(chunk.timeline_names) == ["frame", "time"]
                frames, times = (columns[name].cast("int64").to_pylist() for name in ("frame", "time"))
                stamps = list(zip(frames, times, strict=True))
            for name, column in columns.items():
                if name not in ("frame", "time"):
                    rows = zip(stamps, column.to_pylist(), strict=True)
                    found[chunk.entity_path][name].extend((*stamp, value) for stamp, value in rows)
        for components in found.values():
            for rows in components.values():
                rows.sort(key=lambda row: row[1] or 0)
        return {place: dict(components) for place, components in found.items()}

    return read


@pytest.fixture(scope="session")
def record(rerun, read_back):
    """Record shards and read that back: `record(shards, path, **shown)`."""
    from ogmkit.view.view import Shown, view

    def make(shards, path, **shown):
        view(shards, path, Shown(**shown))
        return read_back(path)

    return make


@pytest.fixture(scope="session")
def recording(rerun, sample_shards, tmp_path_factory):
    """The sample shards as a file; tests only read it."""
    from ogmkit.view.view import view

    path = tmp_path_factory.mktemp("recorded") / "samples.rrd"
    assert view(sample_shards, path) == 16
    return path


@pytest.fixture(scope="session")
def recorded(recording, read_back):
    """The sample shards."""
    return read_back(recording)
