"""Ctrl-C is told of at once, obeyed later; the second one isn't held."""

import hashlib
import os
import signal
import threading
import time

import pytest

from ogmkit.base.news import Quitting, Stopping, listening
from ogmkit.learn.training.interrupts import Interrupted, Interrupts


def press_ctrl_c():
    os.kill(os.getpid(), signal.SIGINT)


def wait_for(told, count):
    while len(told) < count:
        time.sleep(0.001)


def test_the_first_is_remembered_and_the_second_raised():
    told, interrupts = [], Interrupts()
    with listening(told.append), interrupts.held():
        assert not interrupts.asked
        press_ctrl_c()
        assert interrupts.asked
        wait_for(told, 1)
        with pytest.raises(Interrupted):
            press_ctrl_c()
    assert told == [Stopping("step"), Quitting()]
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
    with pytest.raises(KeyboardInterrupt):
        press_ctrl_c()


def test_it_is_told_while_python_is_in_a_long_call():
    told, busy = [], False
    with listening(lambda news: told.append((news, busy))), Interrupts().held():
        threading.Timer(0.05, press_ctrl_c).start()
        busy = True
        hashlib.pbkdf2_hmac("sha256", b"", b"", 5_000_000)
        busy = False
    assert told == [(Stopping("step"), True)]


def test_a_validation_that_begins_after_it_is_told_too():
    told, interrupts = [], Interrupts()
    with listening(told.append), interrupts.held():
        interrupts.begin("validation")
        interrupts.begin("step")
        press_ctrl_c()
        wait_for(told, 1)
        interrupts.begin("validation")
    assert told == [Stopping("step"), Stopping("validation")]


def test_during_a_validation_it_waits_for_that():
    told, interrupts = [], Interrupts()
    with listening(told.append), interrupts.held():
        interrupts.begin("validation")
        press_ctrl_c()
        wait_for(told, 1)
    assert told == [Stopping("validation")]


def test_other_signals_are_no_news():
    told = []
    previous = signal.signal(signal.SIGUSR1, lambda number, frame: None)
    try:
        with listening(told.append), Interrupts().held():
            os.kill(os.getpid(), signal.SIGUSR1)
    finally:
        signal.signal(signal.SIGUSR1, previous)
    assert told == []
