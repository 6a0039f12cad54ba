"""The part of the schema that holds labels by name, `/SURROUND/labels/<definition>/…`.

They follow the samples rather than a camera's frames. Those that lie before the front camera are below its
group, which without the paper's labels holds nothing else.
"""

from dataclasses import replace

from ogmkit.labels.definition import Definition
from ogmkit.shards.fields import COLUMNS, FRAMES, ROWS, Attribute, Field

SURROUND = "SURROUND"
"""The group of labels round the vehicle."""
LABELS = "labels"
SAMPLE_TOKENS = Field(
    "sample_token", "text", (FRAMES,), "token of the key frame; frames stand in temporal order"
)
"""Of a group that holds labels."""
POSES = (
    Field("global_from_ego", "float64", (FRAMES, 4, 4), "ego pose of the sweep", "m", "global", "optional"),
    Field("ego_from_lidar", "float64", (FRAMES, 4, 4), "mounting of the LiDAR", "m", "ego", "optional"),
)
"""Of the group of labels round the vehicle; shards of earlier versions lack them."""

_ARRAY = (FRAMES, ROWS, COLUMNS)
CLASS = Field("<class>", "uint8", _ARRAY, "1 where the class is, by the definition")
BESIDE = (
    Field("instance", "uint16", _ARRAY, "number of the box drawn last, 0 for none", part="optional"),
    Field(
        "visibility",
        "uint8",
        _ARRAY,
        "level of the box drawn last; for none 255, or 0 beside instance",
        part="optional",
    ),
    Field("valid", "uint8", _ARRAY, "1 where the score counts the cell", part="optional"),
    Field("ignore", "uint8", _ARRAY, "1 where the score leaves the cell out", part="optional"),
)
"""Arrays that are no class."""
HAS_SWEEP = Field(
    "has_sweep",
    "bool",
    (FRAMES,),
    "beside ignore: whether there was a LiDAR sweep to find hidden cells by",
    part="optional",
)
LABEL_FIELDS = (CLASS, *BESIDE, HAS_SWEEP)
"""All datasets of a definition's group; rows and columns are the definition's."""
LABEL_ATTRIBUTES = (
    Attribute("definition", str, "the definition's record, as JSON"),
    Attribute("package_version", str, "ogmkit's version that wrote it"),
)


def label_field(name: str) -> Field:
    """The field of an array, or of `has_sweep`, by its name in a definition's group."""
    known = {field.name: field for field in (*BESIDE, HAS_SWEEP)}
    return known.get(name) or replace(CLASS, name=name)


def label_fields(definition: Definition) -> tuple[Field, ...]:
    """The datasets of a definition's group."""
    arrays = tuple(replace(label_field(name), frame=definition.frame) for name in definition.arrays)
    return (*arrays, HAS_SWEEP) if "ignore" in definition.beside else arrays


def label_sizes(record: dict[str, dict[str, dict[str, int]]]) -> dict[str, int]:
    """Rows and columns by a definition's stored record."""
    grid = record["grid"]
    return {ROWS: int(grid["rows"]["cells"]), COLUMNS: int(grid["columns"]["cells"])}


def label_group(definition: Definition) -> str:
    """Where a definition's group stands in the file."""
    return f"/{definition.place}/{LABELS}/{definition.name}"
