import logging
import os
import time
from contextlib import closing
from pathlib import Path

import cv2
import pytest
from threadpoolctl import threadpool_info, threadpool_limits

from ogmkit.base.execution import Execution, run_in_order, run_over
from ogmkit.errors import DataFileError, OgmkitError


@pytest.fixture
def importable(monkeypatch):
    """Functions of this file can be imported by processes that are started."""
    monkeypatch.syspath_prepend(Path(__file__).resolve().parents[2])


def watched(items, drawn):
    for item in items:
        drawn.append(item)
        yield item


def test_all_items_are_done_once_by_processes():
    drawn = []
    with closing(run_over(abs, watched(range(-20, 0), drawn), Execution(workers=2))) as results:
        first = next(results)
        assert len(drawn) == 4  # two a worker: no more records in memory than that
        assert sorted([first, *results]) == list(range(1, 21))


def test_one_worker_is_this_process():
    assert set(run_over(lambda _: os.getpid(), range(3), Execution(workers=1))) == {os.getpid()}


def test_one_worker_is_one_opencv_thread():
    before = cv2.getNumThreads()
    assert list(run_over(lambda _: cv2.getNumThreads(), range(2), Execution(workers=1))) == [1, 1]
    assert cv2.getNumThreads() == before


def blas_threads(info):
    """Of numpy's BLAS; OpenCV may bring one of its own, which nothing here uses."""
    return {library["num_threads"] for library in info if "numpy" in library["filepath"]}


def test_a_worker_is_one_blas_thread_wherever_it_works():
    if not blas_threads(threadpool_info()):
        pytest.skip("numpy's BLAS is none that threadpoolctl knows")
    with threadpool_limits(2, user_api="blas"):
        found = list(run_over(lambda _: threadpool_info(), range(2), Execution(workers=1)))
        look = "__import__('threadpoolctl').threadpool_info()"
        found += run_over(eval, [look, look], Execution(workers=2))
        assert [blas_threads(info) for info in found] == [{1}] * 4
        assert blas_threads(threadpool_info()) == {2}


def test_an_exception_gives_up_the_rest():
    with pytest.raises(TypeError), closing(run_over(abs, [1, "x", 2], Execution(workers=2))) as results:
        list(results)


def slowly(item):
    time.sleep(0.2 * (item == 0))
    return item


@pytest.mark.usefixtures("importable")
def test_results_have_the_items_order_where_that_is_asked_for():
    assert list(run_in_order(slowly, range(7), Execution(workers=2))) == list(range(7))


def warned(item):
    logging.getLogger("ogmkit.test").warning("saw %s", item)
    logging.getLogger("ogmkit.test").debug("too much")
    if item == 2:
        raise DataFileError("a.jpg: is absent", kind="absent")
    return item


@pytest.mark.usefixtures("importable")
def test_log_records_and_errors_come_home_from_processes(caplog):
    caplog.set_level("WARNING", "ogmkit")
    assert sorted(run_over(warned, [0, 1], Execution(workers=2))) == [0, 1]
    with pytest.raises(DataFileError, match="is absent") as raised:
        list(run_over(warned, [2], Execution(workers=2)))
    assert raised.value.kind == "absent"
    assert sorted(caplog.messages) == ["saw 0", "saw 1", "saw 2"]


def test_a_worker_that_dies_is_told():
    with pytest.raises(OgmkitError, match=r"a worker process died.*fewer --workers"):
        list(run_over(os._exit, [3, 3, 3], Execution(workers=2)))
