"""Colours that must be told apart are: by contrast, and as the colour-blind see them."""

import itertools

import numpy as np
import pytest

from ogmkit.drawing.further_cells import LAYERS
from ogmkit.drawing.palette import THEMES, theme, themed

LUMINANCE = np.array([0.2126, 0.7152, 0.0722])
"""Of linear sRGB (WCAG 2.2, relative luminance)."""
XYZ = np.array(
    [
        [0.4124564, 0.3575761, 0.1804375],
        [0.2126729, 0.7151522, 0.0721750],
        [0.0193339, 0.1191920, 0.9503041],
    ]
)
"""From linear sRGB (IEC 61966-2-1), D65."""
SIGHT = {
    "trichromat": np.eye(3),
    # Machado, Oliveira, Fernandes, "A Physiologically-based Model for Simulation of Color Vision
    # Deficiency", 2009, severity 1; on linear sRGB.
    "protanope": np.array(
        [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216], [-0.003882, -0.048116, 1.051998]]
    ),
    "deuteranope": np.array(
        [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.011820, 0.042940, 0.968881]]
    ),
}
MARKS = "vehicle", "first", "second", "future"
AREAS = "drivable", "carpark", "walkway", "road", "lane"
LEAST_DIFFERENCE = 20
"""CIE76 ΔE between marks: ten times the least that is noticed."""

cases = pytest.mark.parametrize(
    ("colours", "sight"),
    [
        pytest.param(colours, matrix, id=f"{name}-{sight}")
        for name, colours in THEMES.items()
        for sight, matrix in SIGHT.items()
    ],
)


def linear(colour):
    """Linear sRGB, 0 … 1 (IEC 61966-2-1)."""
    share = np.array(colour) / 255
    return np.where(share <= 0.04045, share / 12.92, ((share + 0.055) / 1.055) ** 2.4)


def seen(colour, sight):
    return np.clip(sight @ linear(colour), 0, 1)


def contrast(one, other, sight):
    """WCAG 2.2, contrast ratio."""
    darker, lighter = sorted(LUMINANCE @ seen(colour, sight) for colour in (one, other))
    return (lighter + 0.05) / (darker + 0.05)


def lab(colour, sight):
    """CIE 1976 L*a*b*."""
    share = XYZ @ seen(colour, sight) / XYZ.sum(axis=1)
    x, y, z = np.where(share > 216 / 24389, np.cbrt(share), (24389 / 27 * share + 16) / 116)
    return np.array([116 * y - 16, 500 * (x - y), 200 * (y - z)])


def difference(one, other, sight):
    return np.linalg.norm(lab(one, sight) - lab(other, sight))


def test_the_measures_have_their_known_values():
    eye = np.eye(3)

    assert contrast((0, 0, 0), (255, 255, 255), eye) == pytest.approx(21)
    assert contrast((119, 119, 119), (255, 255, 255), eye) == pytest.approx(4.48, abs=0.005)
    np.testing.assert_allclose(lab((255, 0, 0), eye), [53.24, 80.09, 67.20], atol=0.02)
    # What was drawn before: a drivable area, pink and grey that a deuteranope could not tell apart.
    assert contrast((34, 41, 51), (92, 105, 124), eye) == pytest.approx(2.63, abs=0.005)
    assert difference((218, 130, 180), (150, 161, 175), SIGHT["deuteranope"]) < LEAST_DIFFERENCE


@pytest.mark.parametrize("sight", SIGHT.values(), ids=SIGHT)
@pytest.mark.parametrize("name", THEMES)
def test_ground_areas_and_marks_are_three_steps(name, sight):
    colours = THEMES[name]

    for area in AREAS:
        for below in ("ground", "page"):
            assert contrast(getattr(colours, area), getattr(colours, below), sight) >= 3, (area, below)
    for mark in (*MARKS, "text"):
        for below in (*AREAS, "ground", "page", "empty"):
            assert contrast(getattr(colours, mark), getattr(colours, below), sight) >= 3, (mark, below)


@cases
def test_marks_are_told_apart(colours, sight):
    for one, other in itertools.combinations(MARKS, 2):
        assert difference(getattr(colours, one), getattr(colours, other), sight) >= LEAST_DIFFERENCE


@cases
def test_areas_of_the_map_are_told_apart(colours, sight):
    assert set(LAYERS.values()) == {*AREAS, *MARKS}
    for one, other in itertools.combinations(AREAS, 2):
        assert difference(getattr(colours, one), getattr(colours, other), sight) >= LEAST_DIFFERENCE


@cases
def test_letters_can_be_read(colours, sight):
    for letters in ("text", "muted", "alarm"):
        for below in ("page", "empty", "ground"):
            assert contrast(getattr(colours, letters), getattr(colours, below), sight) >= 4.5


@pytest.mark.parametrize("letters", MARKS)
@cases
def test_marks_can_be_letters(colours, sight, letters):
    assert contrast(getattr(colours, letters), colours.page, sight) >= 4.5


def test_a_theme_holds_inside_its_block_alone():
    with themed("light"):
        assert theme() == THEMES["light"]
        with themed("dark"):
            assert theme() == THEMES["dark"]
        assert theme() == THEMES["light"]
    assert theme() == THEMES["dark"]
