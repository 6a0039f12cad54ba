"""Ctrl-C: it ends what runs, also where Python can't raise it."""

import os
import signal
import time

import pytest

from ogmkit.base.interrupts import interrupts_heeded


class Finalised:
    """Sends itself Ctrl-C, or fails, when it is dropped."""

    def __init__(self, error=None):
        self.error = error

    def __del__(self):
        if self.error is not None:
            raise self.error
        os.kill(os.getpid(), signal.SIGINT)
        sum(range(10))


def drop_and_work(error=None):
    one = Finalised(error)
    del one
    time.sleep(0.5)


def test_one_that_comes_into_a_finaliser_is_raised_after_it():
    with pytest.raises(KeyboardInterrupt), interrupts_heeded():
        drop_and_work()


def test_other_errors_of_finalisers_go_where_they_went(monkeypatch):
    told = []
    monkeypatch.setattr("sys.unraisablehook", lambda unraisable: told.append(unraisable.exc_value))
    error = ValueError("of a finaliser")
    with interrupts_heeded():
        drop_and_work(error)
    assert told == [error]
    drop_and_work(error)
    assert told == [error, error]
