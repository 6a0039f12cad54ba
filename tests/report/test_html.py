"""Nothing that is shown ends what it stands in."""

import json
import re
from html.parser import HTMLParser

import pytest
from hypothesis import given
from hypothesis import strategies as st

from ogmkit.report.html import Html, element, inert, inert_json


class Reader(HTMLParser):
    """What a browser would find: tags with attributes, and text."""

    def __init__(self, text):
        super().__init__()
        self.tags, self.text = [], ""
        self.feed(text)
        self.close()

    def handle_starttag(self, tag, attributes):
        self.tags.append((tag, dict(attributes)))

    def handle_data(self, data):
        self.text += data


# A lone carriage return is a line break to every reader of HTML.
WORDS = st.text(st.characters(exclude_categories=["Cs"], exclude_characters="\r\0"))


@given(WORDS, WORDS)
def test_text_and_attributes_come_back_as_they_were(text, value):
    found = Reader(element("p", text, title=value))
    assert found.tags == [("p", {"title": value})]
    assert found.text == text


@given(st.recursive(WORDS, lambda inner: st.lists(inner) | st.dictionaries(WORDS, inner)))
def test_json_comes_back_and_never_ends_its_element(content):
    written = inert_json("data", content)
    (inside,) = re.fullmatch(r"<script[^>]*>(.*)</script>\n", written, re.DOTALL).groups()
    assert json.loads(inside) == content
    assert not re.search(r"[<>&]", inside)


def test_attributes_may_be_left_out_or_stand_alone():
    assert element("td", class_="n", hidden=True, title=None, open=False, data_v="1") == (
        '<td class="n" hidden data-v="1"></td>'
    )
    assert element("img", alt="") == '<img alt="">'


def test_html_stays_and_sequences_follow_each_other():
    assert element("p", [Html("<b>"), "<b>", None, 3]) == "<p><b>&lt;b&gt;3</p>"


def test_inert_text_can_hold_no_sign_that_ends_it():
    with pytest.raises(ValueError, match="could end it"):
        inert("p1", "abc</script>")
