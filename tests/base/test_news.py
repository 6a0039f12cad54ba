"""News reach whoever listens, and only inside the block."""

import threading

from ogmkit.base.news import Found, Stopping, listening, tell


def test_news_go_to_the_innermost_listener():
    outer, inner = [], []
    tell(Found("dropped"))
    with listening(outer.append):
        tell(Found("before"))
        with listening(inner.append):
            tell(Stopping("step"))
        with listening(None):
            tell(Found("dropped"))
        tell(Found("after"))
    tell(Found("dropped"))
    assert outer == [Found("before"), Found("after")]
    assert inner == [Stopping("step")]


def test_other_threads_tell_nobody():
    told = []
    with listening(told.append):
        thread = threading.Thread(target=tell, args=(Found("elsewhere"),))
        thread.start()
        thread.join()
    assert told == []
