"""Names of the definitions, for those that don't draw any."""

PAPER, SURROUND = "paper", "surround"
NAMES = (PAPER, SURROUND, "lss", "fiery", "cvt", "pon", "bevfusion", "pointbev", "stp3")
"""The default first."""
