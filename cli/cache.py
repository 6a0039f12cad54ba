"""`ogmkit cache`: decoded map masks."""

from pathlib import Path

import click

from .command import Command
from .options import cache_dir_option, json_option
from .text import json_text, text_table, with_number


@click.command(
    cls=Command,
    examples=(
        "ogmkit cache",
        "ogmkit cache --clear",
    ),
)
@cache_dir_option
@click.option("--clear", is_flag=True, help="Remove the decoded masks, and nothing else in the folder.")
@json_option
def command(cache_dir: Path | None, clear: bool, as_json: bool) -> None:
    """Show or clear the cache of decoded map masks.

    `ogmkit extract` decodes each map once and keeps the result: up to 150 MB a map. What is cleared is
    decoded again when it is needed. A size of 0×0 marks a file that is damaged or of another version.

    Fields of --json: folder, bytes (in all), masks (a list: file, bytes, shape as rows and columns in
    pixels), cleared (true or false).
    """
    from ogmkit.nuscenes.mask_cache import cache_folder, cached_masks, clear_cache

    folder = cache_folder(cache_dir)
    masks = clear_cache(folder) if clear else cached_masks(folder)
    total = sum(mask.bytes for mask in masks)
    if as_json:
        click.echo(json_text({"folder": folder, "bytes": total, "masks": masks, "cleared": clear}))
        return
    if masks and not clear:
        rows = [(mask.file, "{}×{}".format(*mask.shape), mask.bytes) for mask in masks]
        click.echo(text_table(("file", "pixels", "bytes"), rows))
    held = f"{with_number(len(masks), 'decoded map mask')}, {total:,} bytes"
    click.echo(f"{folder}: {'removed ' if clear else ''}{held}")
