"""The named definitions: frozen, told apart, and with their faults told."""

from dataclasses import FrozenInstanceError, fields

import pytest

from ogmkit.metrics.open_loop.catalogue import DEFINITIONS, EXACT, STP3, UNIAD, VAD


def test_a_definition_cannot_be_changed():
    with pytest.raises(FrozenInstanceError):
        UNIAD.reading = "mean"


def test_each_differs_from_each_other_in_what_it_measures_by():
    told = [
        tuple(
            getattr(one, field.name)
            for field in fields(one)
            if field.name not in ("name", "faults", "source")
        )
        for one in DEFINITIONS.values()
    ]
    assert len(set(told)) == len(DEFINITIONS) == 4
    assert all(name == one.name for name, one in DEFINITIONS.items())
    # One column of a table stands for both.
    assert (STP3.reading, STP3.missing) == (VAD.reading, VAD.missing)


@pytest.mark.parametrize(
    ("definition", "words"),
    [
        (UNIAD, "a missing step counts as an error of 0"),
        (VAD, "looked up 25 m ahead and 25 m to the left"),
        (UNIAD, "never turns"),
        (STP3, "never turns"),
        (VAD, "never turns"),
        (STP3, "steps at which the truth itself collides count as steps without a collision"),
        (EXACT, "contact between two steps is not looked for"),
    ],
)
def test_known_faults_are_told(definition, words):
    assert words in "; ".join(definition.faults)
