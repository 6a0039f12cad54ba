import os
import threading
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing

import cv2
import pytest

from ogmkit.errors import OgmkitError
from ogmkit.pipeline.execution import run_over


def watched(items, drawn):
    for item in items:
        drawn.append(item)
        yield item


def test_all_items_are_done_once_by_processes():
    drawn = []
    with closing(run_over(abs, watched(range(-20, 0), drawn), workers=2, executor=None)) as results:
        first = next(results)
        assert len(drawn) == 4  # two a worker: no more records in memory than that
        assert sorted([first, *results]) == list(range(1, 21))


def test_one_worker_is_this_process():
    assert set(run_over(lambda _: os.getpid(), range(3), workers=1, executor=None)) == {os.getpid()}


def test_one_worker_is_one_opencv_thread():
    before = cv2.getNumThreads()
    assert list(run_over(lambda _: cv2.getNumThreads(), range(2), workers=1, executor=None)) == [1, 1]
    assert cv2.getNumThreads() == before


def test_an_exception_gives_up_the_rest():
    with pytest.raises(TypeError), closing(run_over(abs, [1, "x", 2], workers=2, executor=None)) as results:
        list(results)


def test_a_worker_that_dies_is_told():
    with pytest.raises(OgmkitError, match=r"a worker process died.*fewer --workers"):
        list(run_over(os._exit, [3, 3, 3], workers=2, executor=None))


def test_leaving_waits_for_what_the_callers_executor_has_begun():
    begun, release, ended = threading.Event(), threading.Event(), []

    def work(item):
        if item:
            begun.set()
            release.wait(10)
            ended.append(item)
        return item

    def leave(executor):
        with closing(run_over(work, [0, 1, 2, 3], workers=1, executor=executor)) as results:
            next(results)
            begun.wait(10)
            threading.Timer(0.05, release.set).start()
            raise KeyboardInterrupt

    with ThreadPoolExecutor(1) as executor:
        with pytest.raises(KeyboardInterrupt):
            leave(executor)
        assert ended == [1]  # 2 and 3 were cancelled
