"""Reports in Chromium: no errors, no requests; filters, sorting, keyboard, light and dark."""

import json
from dataclasses import replace

import pytest

from ogmkit.report import part
from ogmkit.report.predictions import Predicted
from ogmkit.report.report import Means, write_report
from ogmkit.report.settings import ReportSettings
from ogmkit.report.sources import sources_of

SCENES = "[...document.querySelectorAll('#gallery .card b')].map(one => one.textContent)"
FOCUS = "[...document.querySelectorAll('#gallery .card')].indexOf(document.activeElement)"
SHOWN = "document.getElementById('shown').textContent"


@pytest.fixture(scope="module")
def report(hostile_shards, tmp_path_factory):
    """A report of two scenes with 16 frames each, of which two of each camera have predictions of a run."""
    monkeypatch = pytest.MonkeyPatch()
    frame, pictures = part._frame, part._pictures

    def predicted(place):
        return (Predicted("oft", (0.5 + 0.1 * place[1], 0.25), ()),) if place[1] in (1, 4) else ()

    def with_predicted(task, shard, place, *rest):
        return replace(frame(task, shard, place, *rest), predicted=predicted(place))

    def with_pictures(task, shard, place):
        found = pictures(task, shard, place)
        return (*found, *found[1:], *found[1:]) if predicted(place) else found

    monkeypatch.setattr(part, "_frame", with_predicted)
    monkeypatch.setattr(part, "_pictures", with_pictures)
    path = tmp_path_factory.mktemp("page") / "report.html"
    write_report(
        path, sources_of([hostile_shards]), ReportSettings(frames=16, no_verify=True, no_check=True), Means()
    )
    monkeypatch.undo()
    return path


@pytest.fixture
def page(browse, report):
    with browse() as page:
        page.open(report)
        yield page


def scroll_to_frames(page):
    """Scroll there, until a picture is decoded."""
    page.value("document.getElementById('filters').scrollIntoView({behavior: 'instant'})")
    page.wait("document.querySelector('#gallery img[src]') !== null")


def choose(page, name, value):
    """Fill in a filter."""
    page.value(
        f"(() => {{ const form = document.getElementById('filters'); form.elements.{name}.value = "
        f"{json.dumps(value)}; form.dispatchEvent(new Event('input')); }})()"
    )


def test_it_loads_without_an_error_and_asks_for_nothing(page, report, hostile_scene):
    scroll_to_frames(page)
    assert page.said == []
    assert page.asked == [report.as_uri()]
    assert page.value("document.title") != "broken"
    assert hostile_scene in page.value("document.querySelector('#scenes tbody').textContent")


def test_pictures_are_decoded_when_they_are_scrolled_to(page):
    assert page.value("document.querySelectorAll('img[src]').length") == 0
    scroll_to_frames(page)
    first = page.value("document.querySelectorAll('img[src]').length")
    assert 0 < first < page.value("document.querySelectorAll('#gallery img').length")
    page.value("document.querySelector('#gallery .card:last-child').scrollIntoView()")
    page.wait("document.querySelector('#gallery .card:last-child img').src !== ''")
    page.wait("document.querySelector('#gallery .card:last-child img').naturalWidth > 0")


def test_filters_filter(page, hostile_scene):
    assert page.value(SHOWN) == "32 of 32"
    choose(page, "scene", "ONERROR")
    assert set(page.value(SCENES)) == {hostile_scene}
    assert page.value(SHOWN) == "16 of 32"
    choose(page, "camera", "1")
    assert page.value(SHOWN) == "8 of 32"
    choose(page, "scene", "")
    choose(page, "validity", "whole")
    whole = page.value("document.querySelectorAll('#gallery .card').length")
    choose(page, "validity", "lacking")
    assert whole + page.value("document.querySelectorAll('#gallery .card .lacks').length") == 16
    choose(page, "scene", "no such scene")
    assert page.value(SHOWN) == "0 of 32"
    assert page.said == []


def test_frames_are_filtered_by_what_they_lack(page):
    reasons = page.value("JSON.parse(document.getElementById('frames-data').textContent).lacks")
    number = next(number for number, reason in enumerate(reasons) if "<b onclick" in reason)
    choose(page, "validity", str(number))
    found = page.value("[...document.querySelectorAll('.lacks')].map(one => one.textContent)")
    assert len(found) == 1
    assert reasons[number] in found[0]


def test_the_worst_come_first(page):
    choose(page, "sort", "0 0")
    notes = page.value("[...document.querySelectorAll('#gallery .caption span')].map(one => one.textContent)")
    assert notes == ["IoU 60.0 %"] * 4 + ["IoU 90.0 %"] * 4
    assert page.value("document.querySelectorAll('#examples-gallery .card').length") == 8


def test_the_keyboard_moves_through_frames_and_leafs(page):
    page.value("document.querySelector('#gallery .card').focus()")
    page.press("ArrowRight")
    assert page.value(FOCUS) == 1
    page.press("ArrowDown")
    below = page.value(FOCUS)
    assert below > 2
    page.press("ArrowUp")
    assert page.value(FOCUS) == 1
    page.press("Enter")
    page.wait("document.getElementById('viewer').open")
    page.press("ArrowRight")
    page.press("ArrowRight")
    assert page.value("document.getElementById('viewer-place').textContent") == "4 of 32"
    page.press("ArrowLeft")
    page.press("Escape")
    page.wait(f"{FOCUS} === 2")  # the dialog says that it is closed a moment after it is
    assert not page.value("document.getElementById('viewer').open")
    page.press("End")
    page.press("ArrowRight")
    assert page.value(FOCUS) == 31
    assert page.value("document.querySelectorAll('#gallery [tabindex=\"0\"]').length") == 1
    assert page.said == []


def test_headings_sort_by_numbers_and_by_words(page):
    cells = "[...document.querySelectorAll('#scenes tbody td:first-child')].map(one => one.textContent)"
    button = "document.querySelector('#scenes th:nth-child(1) button')"
    names = page.value(cells)
    page.value(f"{button}.focus()")
    page.press("Enter")
    assert page.value(cells) == sorted(names)
    page.press(" ")
    assert page.value(cells) == sorted(names)[::-1]
    assert page.value(f"{button}.closest('th').getAttribute('aria-sort')") == "descending"
    sizes = "[...document.querySelectorAll('#scenes td:last-child')].map(one => Number(one.dataset.v))"
    page.value("document.querySelector('#scenes th:last-child button').click()")
    assert page.value(sizes) == sorted(page.value(sizes))


def test_light_and_dark_by_the_system_and_by_the_switch(browse, report):
    background = "getComputedStyle(document.body).backgroundColor"
    plane = "document.querySelector('#gallery img:nth-child(2)').src"
    with browse(dark=True) as page:
        page.open(report)
        scroll_to_frames(page)
        page.wait(f"{plane} !== ''")
        dark = page.value(background), page.value(plane)
        page.value("document.querySelector('.themes input[value=light]').click()")
        light = page.value(background), page.value(plane)
        page.value("document.querySelector('.themes input[value=\"\"]').click()")
        assert (page.value(background), page.value(plane)) == dark
    assert dark[0] == "rgb(13, 17, 23)"
    assert light[0] == "rgb(255, 255, 255)"
    assert dark[1] != light[1]
