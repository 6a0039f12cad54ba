"""Numbers of settings that no computer counts to."""

from dataclasses import dataclass

import pytest

from ogmkit.base.stated import require_stated, setting
from ogmkit.errors import SettingsError


@dataclass(frozen=True)
class Thing:
    count: int = setting(1, "A count.", low=1)


def test_a_number_too_large_for_any_machine_is_named_without_its_digits():
    with pytest.raises(SettingsError, match=r"^count: a number of 401 digits is too large$"):
        require_stated(Thing(10**400))
    require_stated(Thing(2**63 - 1))
    with pytest.raises(SettingsError, match="a number of 19 digits is too large"):
        require_stated(Thing(2**63))
