"""Rules that follow from the schema: values there and of their type, tokens unique, references met."""

from collections.abc import Sequence

from ogmkit.nuscenes.schema import EDGE_TABLES, TABLES, Column, columns
from ogmkit.nuscenes.uses import Query, placed, unused, used

# Annotations come to scenes by their samples: where none has one, every scene would silently lose its own.
_NO_SAMPLES = placed(
    "sample_annotation",
    "SELECT 'number 1' AS record, 'sample_token leads to no key frame, nor does any other record''s' "
    "AS detail, token AS scene, NULL::VARCHAR AS channel FROM scene WHERE EXISTS (FROM sample_annotation) "
    "AND NOT EXISTS (FROM sample_annotation a JOIN sample s ON s.token = a.sample_token)",
)


def missing_values(complete: bool) -> tuple[Query, ...]:
    """NULLs: keys that are absent, null, or (after the strict reading) of the wrong type."""
    names = _names(complete)
    edge = (used(table, _nulls(table, columns(table, complete=False))) for table in names)
    checked = ((table, _checked(table)) for table in names if complete)
    return (*edge, *(unused(table, _nulls(table, rest)) for table, rest in checked if rest))


def duplicate_tokens(complete: bool) -> tuple[Query, ...]:
    """Tokens that stand in more than one record."""
    return tuple(
        used(
            table,
            "SELECT rowid AS row, token AS record, 'token stands in several records' AS detail FROM "
            f"{table} WHERE token IN (SELECT token FROM {table} GROUP BY token HAVING count(*) > 1)",
        )
        for table in _names(complete)
    )


def dangling_references(complete: bool) -> tuple[Query, ...]:
    """Tokens that no record of the table referred to bears."""
    dangling = tuple(
        (used if column.edge else unused)(table, _dangling(table, column))
        for table in _names(complete)
        for column in columns(table, complete=complete)
        if column.refers_to is not None
    )
    return (*dangling, _NO_SAMPLES)


def _names(complete: bool) -> tuple[str, ...]:
    return tuple(TABLES) if complete else EDGE_TABLES


def _checked(table: str) -> tuple[Column, ...]:
    return tuple(column for column in TABLES[table] if not column.edge and not column.optional)


def _nulls(table: str, chosen: Sequence[Column]) -> str:
    chosen = [column for column in chosen if not column.optional]
    named = ", ".join(f"CASE WHEN {c.name} IS NULL THEN '{c.name}' END" for c in chosen)
    condition = " OR ".join(f"{c.name} IS NULL" for c in chosen)
    return (
        f"SELECT rowid AS row, coalesce(token, 'number ' || (rowid + 1)) AS record, concat_ws(', ', {named}) "
        f"|| ' missing or of the wrong type' AS detail FROM {table} WHERE {condition}"
    )


def _dangling(table: str, column: Column) -> str:
    name, target = column.name, column.refers_to
    empty = f"AND t.{name} <> ''" if column.may_be_empty else ""
    return (
        f"SELECT t.rowid AS row, t.token AS record, '{name} ''' || t.{name} || ''' is not in {target}.json' "
        f"AS detail FROM {table} t ANTI JOIN {target} r ON r.token = t.{name} "
        f"WHERE t.{name} IS NOT NULL {empty}"
    )
