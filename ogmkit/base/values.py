"""Values of a YAML file as fields of frozen dataclasses, each of the kind that its annotation says."""

import dataclasses
import os
import reprlib
from collections.abc import Mapping
from pathlib import Path
from types import NoneType, UnionType
from typing import Any, Literal, TypeVar, Union, get_args, get_origin, get_type_hints

from ogmkit.base.names import unknown
from ogmkit.errors import SettingsError

Record = TypeVar("Record")

_SHOWN = reprlib.Repr()
"""Values in messages: YAML's references make long ones of short files."""
_SHOWN.maxstring = _SHOWN.maxother = _SHOWN.maxlong = 100
_SHOWN.maxlevel = 2

_KINDS: Mapping[Any, str] = {
    bool: "true or false",
    int: "a whole number",
    float: "a number",
    str: "text",
    Path: "a path",
    tuple: "a list",
}


def field_names(cls: type[Any]) -> tuple[str, ...]:
    """Names of a dataclass's fields, in order."""
    return tuple(field.name for field in dataclasses.fields(cls))


def built(cls: type[Record], values: Mapping[str, Any], where: str) -> Record:
    """Make a settings record of what a file says; what it leaves out has the record's default.

    Args:
        cls: a dataclass that checks itself.
        values: field → plain value of YAML.
        where: file and section, for messages.

    Raises:
        SettingsError: a field is unknown, or a value of another kind or out of range; names file and field.
    """
    require_known(values, field_names(cls), where)
    hints = get_type_hints(cls)
    fields = {name: converted(value, hints[name], f"{where}: {name}") for name, value in values.items()}
    try:
        return cls(**fields)
    except SettingsError as error:
        raise SettingsError(f"{where}: {error}") from error


def mapping(found: object, where: str) -> dict[str, Any]:
    """A section of a file: a copy of what it holds; nothing where it is empty.

    Raises:
        SettingsError: it is not a mapping of names.
    """
    if found is None:
        return {}
    if not isinstance(found, Mapping) or not all(isinstance(key, str) for key in found):
        raise SettingsError(f"{where}: not a mapping of setting: value")
    return dict(found)


def require_known(values: Mapping[str, Any], known: tuple[str, ...], where: str) -> None:
    """Refuse names that mean nothing.

    Raises:
        SettingsError: there is one; says what is meant, or what there is.
    """
    for name in values:
        if name not in known:
            raise SettingsError(f"{where}: {unknown('setting', name, known)}")


def converted(value: object, hint: Any, where: str) -> Any:  # noqa: ANN401  # as the annotation says
    """A plain value of YAML as an annotation wants it: lists as tuples, `1e-3` as a number.

    Raises:
        SettingsError: it is of another kind.
    """
    origin, inner = get_origin(hint), get_args(hint)
    if origin in (Union, UnionType):
        if value is None and NoneType in inner:
            return None
        (hint,) = (one for one in inner if one is not NoneType)
        return converted(value, hint, where)
    if origin is Literal:
        if value not in inner:
            raise SettingsError(
                f"{where}: {unknown('value', value if isinstance(value, str) else _SHOWN.repr(value), inner)}"
            )
        return value
    if origin is tuple:
        return _converted_list(value, inner, where)
    return _converted_scalar(value, hint, where)


def _converted_list(value: object, inner: tuple[Any, ...], where: str) -> tuple[Any, ...]:
    if not isinstance(value, list | tuple):
        raise SettingsError(f"{where}: {_SHOWN.repr(value)} is not {_KINDS[tuple]}")
    if Ellipsis in inner:
        return tuple(converted(one, inner[0], where) for one in value)
    if len(value) != len(inner):
        raise SettingsError(f"{where}: {_SHOWN.repr(list(value))} is not a list of {len(inner)}")
    return tuple(converted(one, hint, where) for one, hint in zip(value, inner, strict=True))


def _converted_scalar(value: object, hint: Any, where: str) -> Any:  # noqa: ANN401
    if hint is float:
        number = _number(value)
        if number is not None:
            return number
    elif hint is Path:
        if isinstance(value, str) and _names_a_file(value):
            return Path(value)
    elif isinstance(value, hint) and (hint is bool or not isinstance(value, bool)):
        return value
    raise SettingsError(f"{where}: {_SHOWN.repr(value)} is not {_KINDS[hint]}")


def _names_a_file(text: str) -> bool:
    """Whether the system could have a file of that name."""
    try:
        return b"\0" not in os.fsencode(text)
    except UnicodeEncodeError:
        return False


def _number(value: object) -> float | None:
    """A number; YAML reads `1e-3`, which has no point, as text."""
    if isinstance(value, bool) or not isinstance(value, int | float | str):
        return None
    try:
        return float(value)
    except (ValueError, OverflowError):  # a whole number may exceed all floats
        return None
