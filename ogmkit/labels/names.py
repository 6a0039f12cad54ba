"""Names of the definitions, for those that don't draw any."""

PAPER = "paper"
NAMES = (PAPER, "lss", "fiery", "cvt", "pon", "bevfusion", "pointbev", "stp3")
"""The default first."""
