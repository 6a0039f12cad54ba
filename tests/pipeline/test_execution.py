import os
import threading
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from contextlib import closing
from multiprocessing import get_context

import cv2
import pytest
from threadpoolctl import threadpool_info, threadpool_limits

from ogmkit.errors import OgmkitError
from ogmkit.pipeline.execution import Execution, run_over


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
        with ThreadPoolExecutor(2) as executor:
            found += run_over(lambda _: threadpool_info(), range(2), Execution(executor=executor))
        with ProcessPoolExecutor(1, get_context("spawn")) as executor:
            look = "__import__('threadpoolctl').threadpool_info()"
            found += run_over(eval, [look, look], Execution(executor=executor))
        assert [blas_threads(info) for info in found] == [{1}] * 6
        assert blas_threads(threadpool_info()) == {2}


def test_an_exception_gives_up_the_rest():
    with pytest.raises(TypeError), closing(run_over(abs, [1, "x", 2], Execution(workers=2))) as results:
        list(results)


def test_a_worker_that_dies_is_told():
    with pytest.raises(OgmkitError, match=r"a worker process died.*fewer --workers"):
        list(run_over(os._exit, [3, 3, 3], Execution(workers=2)))


def test_leaving_waits_for_what_the_callers_executor_has_begun():
    begun, release, ended = threading.Event(), threading.Event(), []

    def work(item):
        if item:
            begun.set()
            release.wait(10)
            ended.append(item)
        return item

    def leave(executor):
        with closing(run_over(work, [0, 1, 2, 3], Execution(executor=executor))) as results:
            next(results)
            begun.wait(10)
            threading.Timer(0.05, release.set).start()
            raise KeyboardInterrupt

    with ThreadPoolExecutor(1) as executor:
        with pytest.raises(KeyboardInterrupt):
            leave(executor)
        assert ended == [1]  # 2 and 3 were cancelled
