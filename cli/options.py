"""Arguments and options that commands share: each has one spelling and one help text."""

import re
from collections.abc import Callable, Sequence
from typing import Any, TypeVar

import click

from ogmkit.drawing.palette import THEMES
from ogmkit.errors import SettingsError

from .paths import EXISTING, EXISTING_FOLDER, FOLDER, SHARDS

Function = TypeVar("Function", bound=Callable[..., Any])


class NameList(click.ParamType):  # type: ignore[type-arg]  # not generic in older Click
    """Names separated by commas, as a tuple.

    Args:
        choices: the names there are; none where any name will do.
    """

    name = "name,…"

    def __init__(self, choices: Sequence[str] = ()) -> None:
        self.choices = tuple(choices)

    def convert(
        self, value: str | tuple[str, ...], param: click.Parameter | None, ctx: click.Context | None
    ) -> tuple[str, ...]:
        """Split one occurrence of the option; a tuple (already split) passes."""
        names = value if isinstance(value, tuple) else tuple(name.strip() for name in value.split(","))
        if not all(names):
            self.fail(f"{value!r} holds an empty name", param, ctx)
        for name in names:
            if self.choices and name not in self.choices:
                self.fail(f"{name!r} is not one of {', '.join(self.choices)}", param, ctx)
        return names

    def split_envvar_value(self, rv: str) -> list[str]:
        """An environment variable's value is one occurrence of the option."""
        return [rv]


def list_option(
    *declarations: str,
    choices: Sequence[str] = (),
    default: Sequence[str] = (),
    **attributes: Any,  # noqa: ANN401  # of `click.option`
) -> Callable[[Function], Function]:
    """An option that takes a list, as a tuple of names: repeated, or separated by commas, or both."""
    return click.option(
        *declarations,
        type=NameList(choices),
        multiple=True,
        default=tuple(default),
        callback=_joined,
        **attributes,
    )


def workers_option_of(text: str) -> Callable[[Function], Function]:
    """`--workers`, with the help that says what they do."""
    return click.option(
        "--workers",
        type=click.IntRange(min=0),
        default=1,
        show_default=True,
        callback=lambda context, parameter, value: max(value, 1),
        help=text,
    )


def _joined(
    context: click.Context, parameter: click.Parameter, values: Sequence[tuple[str, ...]]
) -> tuple[str, ...]:
    """All occurrences of an option as one tuple."""
    del context, parameter
    return tuple(name for names in values for name in names)


def _scheduler(context: click.Context, parameter: click.Parameter, value: str) -> str:
    """Refuse what can't be a scheduler, as any wrong value of an option."""
    if value:
        from ogmkit.base.cluster import require_usable

        try:
            require_usable(value)
        except SettingsError as error:
            raise click.BadParameter(str(error), context, parameter) from error
    return value


def size(value: str | Sequence[int]) -> tuple[int, int]:
    """An option's type: HEIGHTxWIDTH, such as 448x800, as (height, width); two numbers (a default) pass."""
    if not isinstance(value, str):
        height, width = value
        return int(height), int(width)
    match = re.fullmatch(r"([1-9]\d{0,4})x([1-9]\d{0,4})", value, re.ASCII | re.IGNORECASE)
    if match is None:
        raise click.BadParameter(f"{value!r} is not HEIGHTxWIDTH, such as 448x800")
    return int(match[1]), int(match[2])


dataroot_argument = click.argument("dataroot", type=EXISTING_FOLDER)
"""DATAROOT, as `dataroot: Path`: an existing folder that holds `v1.0-*`, `samples` and `maps`."""

shards_argument = click.argument("shards", type=SHARDS)
"""SHARDS, as `shards: Path`: an existing folder that `ogmkit extract` wrote."""

version_option = click.option(
    "--version",
    metavar="NAME",
    help="Folder of the tables, such as v1.0-mini.  [default: the only v1.0-* folder there is]",
)

scenes_option = list_option(
    "--scenes",
    metavar="NAME,…",
    help="Scene names, or patterns such as 'scene-00*'; repeat the option or separate them by commas.  "
    "[default: every scene]",
)

splits_option = list_option(
    "--split",
    "splits",
    metavar="NAME,…",
    help="Only the scenes of these splits, such as train,val.  [default: every scene]",
)

split_file_option = click.option(
    "--split-file",
    type=EXISTING,
    help="JSON file: split name → list of scene names; or a folder of published lists, train.txt and so on, "
    "a scene a line.  [default: the dataset's splits.json, else the "
    "official splits]",
)

shards_split_file_option = click.option(
    "--split-file",
    type=EXISTING,
    help="JSON file: split name → list of scene names; or a folder of published lists, train.txt and so on, "
    "a scene a line.  [default: the splits that the shards were made with]",
)

theme_option = click.option(
    "--theme",
    type=click.Choice(list(THEMES)),
    default=next(iter(THEMES)),
    show_default=True,
    help="Colours of pictures: dark for screens, light for paper.",
)

workers_option = workers_option_of("Number of worker processes; 0 or 1 works in this process.")

scheduler_option = click.option(
    "--scheduler",
    metavar="ADDRESS|local",
    default="",
    callback=_scheduler,
    help="Dask scheduler whose workers do the work, such as tcp://10.0.0.7:8786, or local: a Dask cluster of "
    "--workers processes of this machine.  [default: none]",
)

cache_dir_option = click.option(
    "--cache-dir",
    type=FOLDER,
    help="Folder for decoded map masks.  [default: OGMKIT_CACHE_DIR, else the user's cache folder]",
)

json_option = click.option(
    "--json",
    "as_json",
    is_flag=True,
    help="Write one JSON document to stdout instead, with the fields above.",
)


def cameras_option(*default: str) -> Callable[[Function], Function]:
    """`--camera`, as `cameras: tuple[str, ...]`; no default, no value: all there are."""
    return list_option(
        "--camera",
        "cameras",
        metavar="CHANNEL,…",
        default=default,
        show_default=True if default else "all",
        help="Camera channel, such as CAM_FRONT; repeat the option or separate channels by commas.",
    )
