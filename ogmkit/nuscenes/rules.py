"""Numbered rules that tables must keep: one list for the edge (scene by scene) and for `ogmkit check`."""

from dataclasses import dataclass

from ogmkit.nuscenes import rules_links, rules_schema, rules_values
from ogmkit.nuscenes.found import WRONG_VALUE
from ogmkit.nuscenes.tables import Tables
from ogmkit.nuscenes.uses import Query

_EXTRACT = "extract the metadata archive again"
_VALUE = "correct the record (ogmkit check --fix mends links), or extract the metadata archive again"
_PATH = "write it relative to the dataset, with / between folders (ogmkit check --fix replaces backslashes)"
_LINKS = "correct the links (ogmkit check --fix), or leave the scene out"
_UNUSED = "harmless: not used here; ogmkit check --fix corrects it"
_CORRECT = "correct the record or leave the scene out"
CONCERNS = (
    "((channel IS NULL OR list_contains($channels, channel)) "
    "AND ($maps OR source <> 'map' AND rule <> 'R503'))"
)
"""Of the table `violation`: what matters to a use of these channels, with map masks or without."""


@dataclass(frozen=True)
class Rule:
    """One rule.

    Attributes:
        id: such as R301; the first digit is the kind of damage.
        title: what is wrong where the rule is broken.
        remedy: what to do then.
        queries: find the violations.
    """

    id: str
    title: str
    remedy: str
    queries: tuple[Query, ...]


_OF_CHECK = (
    Rule("R601", "prev/next of images and sweeps is broken", _UNUSED, rules_links.IMAGE_LINKS),
    Rule("R602", "prev/next of annotations is broken", _UNUSED, rules_links.ANNOTATION_LINKS),
    Rule("R603", "instance miscounts its annotations", _UNUSED, rules_links.INSTANCES),
    Rule(
        "R604",
        "map lists unknown logs",
        "harmless: maps list the whole dataset's",
        rules_values.LISTED_LOGS,
    ),
    Rule("R605", "attribute is unknown", "harmless: not used here", rules_values.LISTED_ATTRIBUTES),
    Rule(
        "R607",
        "visibility has no known level",
        "harmless: unknown visibility passes every filter",
        rules_values.VISIBILITIES,
    ),
)
"""Rules that only `ogmkit check` looks at."""


def rules(*, complete: bool) -> tuple[Rule, ...]:
    """All rules in order of number; causes come before what follows from them.

    Args:
        complete: for completely loaded tables, with the rules that only `ogmkit check` looks at.
    """
    edge = (
        Rule(
            WRONG_VALUE, "value missing or of the wrong type", _VALUE, rules_schema.missing_values(complete)
        ),
        Rule("R202", "token not unique", _EXTRACT, rules_schema.duplicate_tokens(complete)),
        Rule("R203", "token refers to no record", _EXTRACT, rules_schema.dangling_references(complete)),
        Rule("R301", "rotation is not a unit quaternion", _CORRECT, rules_values.QUATERNIONS),
        Rule("R302", "translation is not finite or beyond all maps", _CORRECT, rules_values.TRANSLATIONS),
        Rule("R303", "box size is not positive or immense", _CORRECT, rules_values.BOX_SIZES),
        Rule("R305", "intrinsics are singular", _CORRECT, rules_values.INTRINSICS),
        Rule("R306", "image size is missing or out of range", _CORRECT, rules_values.IMAGE_SIZES),
        Rule("R307", "timestamp is not positive", _CORRECT, rules_values.TIMESTAMPS),
        Rule(
            "R308",
            "timestamp is not in microseconds",
            "convert all timestamps to integer microseconds",
            rules_values.TIME_UNITS,
        ),
        Rule(
            "R309",
            "image has lens distortion",
            "undistort the images, with the new camera_intrinsic and a camera_distortion of zeros",
            rules_values.DISTORTIONS,
        ),
        Rule("R401", "chain of key frames is broken or cyclic", _LINKS, rules_links.CHAINS),
        Rule("R402", "key frame lacks a sensor or has it twice", _CORRECT, rules_links.SENSORS),
        Rule("R403", "time runs backwards", _CORRECT, rules_links.TIMES),
        Rule("R501", "file name leaves the dataset", _PATH, rules_values.FILE_NAMES),
        Rule("R502", "scene name is not a unique, valid file name", _CORRECT, rules_values.SCENE_NAMES),
        Rule("R503", "scene has no map of its own", f"{_CORRECT}, or --no-map", rules_values.MAPS),
        Rule("R504", "channel is not a valid file name", _CORRECT, rules_values.CHANNELS),
    )
    return (*edge, *_OF_CHECK) if complete else edge


def find_violations(tables: Tables) -> tuple[Rule, ...]:
    """Apply the rules; the violations stand in the table `violation` afterwards, in order of rule.

    Args:
        tables: loaded and prepared (`uses.prepare`).

    Returns:
        The rules applied.
    """
    tables.execute(
        "CREATE OR REPLACE TABLE violation "
        "(rule VARCHAR, source VARCHAR, record VARCHAR, detail VARCHAR, scene VARCHAR, channel VARCHAR)"
    )
    applied = rules(complete=tables.complete)
    for rule in applied:
        for query in rule.queries:
            if not tables.rows(f"SELECT 1 FROM ({query.probe}) LIMIT 1"):
                continue
            tables.execute(
                f"INSERT INTO violation SELECT '{rule.id}', '{query.table}', record, detail, scene, channel "
                f"FROM ({query.sql})"
            )
    return applied
