"""Names of mask sets and of sources: what one function writes, the other reads."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from ogmkit.footprints.sets import MaskKind, mask_kind
from ogmkit.homography.methods import METHODS
from ogmkit.homography.sources import is_network, is_source, preferred_source, sources_of

SOURCES = st.sampled_from([*METHODS, "network", "network-b"])


@given(SOURCES, st.sampled_from(["warp", "project"]))
def test_a_default_name_reads_as_what_it_was_made_of(source, method):
    kind = MaskKind(method, source)

    assert mask_kind(kind.name) == kind


@given(SOURCES, SOURCES)
def test_a_source_for_each_reads_as_what_it_was_made_of(drivable, vehicles):
    kind = MaskKind("warp", f"{drivable}+{vehicles}")

    assert mask_kind(kind.name) == kind
    assert sources_of(kind.homography) == (drivable, vehicles)


@given(SOURCES)
def test_one_source_serves_both(source):
    assert sources_of(source) == (source, source)


def test_names():
    assert MaskKind("project", "dlt").name == "dlt-project"
    assert MaskKind("full-body", "dlt").name == "full-body"
    assert mask_kind("full-body") == MaskKind("full-body", "surface")
    assert mask_kind("network-project") == MaskKind("project", "network")


@pytest.mark.parametrize(
    "name",
    [
        "large",
        "dlt-projected",
        "networks",
        "",
        "-project",
        "surface+",
        "+plane",
        "surface+flat",
        "surface+plane-project",
    ],
)
def test_other_names_are_the_users(name):
    assert mask_kind(name) is None


@pytest.mark.parametrize(
    ("name", "network", "source"),
    [
        ("network", True, True),
        ("network-b", True, True),
        ("network-", False, False),
        ("networked", False, False),
        ("surface", False, True),
        ("flat", False, False),
    ],
)
def test_sources(name, network, source):
    assert (is_network(name), is_source(name)) == (network, source)


def test_what_is_preferred():
    assert preferred_source(["dlt", "surface", "network"]) == "network"
    assert preferred_source({"surface"}) == "surface"
    assert preferred_source(("dlt",)) is None
