import multiprocessing
import pickle

import pytest

from ogmkit.errors import ShardError
from ogmkit.learn.data.pool import ShardPool


@pytest.fixture
def paths(sample_shards):
    return sorted(sample_shards.glob("*.h5"))


def scenes(pool, numbers):
    return [pool.shard(number).scene for number in numbers]


def test_a_shard_stays_open(paths):
    pool = ShardPool(paths)

    assert pool.shard(1) is pool.shard(1)
    assert scenes(pool, [0, 1, 0]) == [path.stem for path in (paths[0], paths[1], paths[0])]
    pool.close()


def test_the_one_used_longest_ago_is_closed(paths):
    pool = ShardPool([*paths, *paths], max_open=2)
    first, second = pool.shard(0), pool.shard(1)
    pool.shard(0)

    pool.shard(2)

    assert first.h5.id.valid
    assert not second.h5.id.valid
    assert pool.shard(1).h5.id.valid
    assert not first.h5.id.valid
    pool.close()


def test_small_datasets_stay_at_hand_and_rasters_do_not(paths):
    """An open dataset in chunks keeps one of them in memory."""
    pool = ShardPool(paths)
    shard = pool.shard(0)

    poses = shard.dataset("CAM_FRONT", "global_from_ego")

    assert shard.dataset("CAM_FRONT", "global_from_ego") is poses
    assert shard.dataset("CAM_BACK", "global_from_ego") is not poses
    assert shard.dataset("CAM_FRONT", "drivable") is not shard.dataset("CAM_FRONT", "drivable")
    pool.close()
    assert not shard.h5


def test_handles_are_not_pickled(paths):
    pool = ShardPool(paths)
    own = pool.shard(0)

    other = pickle.loads(pickle.dumps(pool))

    assert other.shard(0) is not own
    assert other.shard(0).scene == own.scene
    other.close()
    assert own.h5.id.valid
    pool.close()


def _report(pool, inherited, queue):
    opened = pool.shard(0)
    queue.put((opened is not inherited, opened.scene, bool(inherited.h5.id.valid)))


@pytest.mark.filterwarnings("ignore:.*fork:DeprecationWarning")
def test_a_forked_process_opens_its_own(paths):
    pool = ShardPool(paths)
    own = pool.shard(0)
    context = multiprocessing.get_context("fork")
    queue = context.Queue()
    process = context.Process(target=_report, args=(pool, own, queue))

    process.start()
    reopened, scene, inherited_is_open = queue.get(timeout=30)
    process.join()

    assert reopened
    assert scene == own.scene
    assert not inherited_is_open
    assert pool.shard(0) is own
    assert own.frames("CAM_FRONT") == 8
    pool.close()


def test_an_absent_shard_is_named(tmp_path):
    with pytest.raises(ShardError, match=r"gone\.h5: is absent"):
        ShardPool([tmp_path / "gone.h5"]).shard(0)
