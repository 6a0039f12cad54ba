"""What the site is made of: MkDocs calls these functions (`hooks` of mkdocs.yml).

Files keep their paths in the repository, since README.md and pages link to each other, to examples and to
results. Pages of the reference are made here: the help of every command, and the public names.
"""

import ast
from collections.abc import Iterator
from pathlib import Path

import click
from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files
from ogmkit_cli.main import COMMANDS, main

import ogmkit

ROOT = Path(__file__).resolve().parents[1]
SOURCES = (
    *("README.md", "CHANGELOG.md", "CONTRIBUTING.md", "CITATION.cff", "LICENSE"),
    *("docs/**/*.md", "docs/**/*.jpg", "docs/**/*.png", "docs/**/*.svg", "docs/**/*.webp"),
    *("examples/*.py", "examples/*.yaml", "examples/*.json", "benchmarks/RESULTS.md"),
)
"""Patterns of the files that the site has."""
HELP_WIDTH = 100


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Take the theme's files and the repository's, each at its own path."""
    docs = Path(config.docs_dir)
    kept = [
        file for file in files if file.abs_src_path is None or docs not in Path(file.abs_src_path).parents
    ]
    paths = sorted(path for pattern in SOURCES for path in ROOT.glob(pattern))
    own = [
        File.generated(config, path.relative_to(ROOT).as_posix(), abs_src_path=str(path)) for path in paths
    ]
    made = {"commands": commands_page(), "python": python_page()}
    pages = [
        File.generated(config, f"docs/reference/{name}.md", content=content) for name, content in made.items()
    ]
    return Files([*kept, *own, *pages])


def commands_page() -> str:
    """The help of every command, as `--help` prints it."""
    parts = ["# Commands", "", "What `ogmkit COMMAND --help` prints, all of it."]
    for name, command in _commands():
        context = click.Context(command, info_name=f"ogmkit {name}", terminal_width=HELP_WIDTH)
        parts += ["", f"## {name}", "", "```text", command.get_help(context), "```"]
    return "\n".join(parts) + "\n"


def _commands() -> Iterator[tuple[str, click.Command]]:
    """Each command by its full name, a group before its members."""
    context = click.Context(main)
    for name in COMMANDS:
        found = main.get_command(context, name)
        assert found is not None  # COMMANDS is what `main` finds
        yield name, found
        if isinstance(found, click.Group):
            inner = click.Context(found)
            for member in found.list_commands(inner):
                command = found.get_command(inner, member)
                assert command is not None
                yield f"{name} {member}", command


def python_page() -> str:
    """Directives of mkdocstrings for what `ogmkit`, `ogmkit.torch` and `ogmkit.errors` offer."""
    errors = Path(ogmkit.__file__).with_name("errors.py")
    classes = [
        node.name for node in ast.parse(errors.read_text("utf-8")).body if isinstance(node, ast.ClassDef)
    ]
    rooms = {"ogmkit": ogmkit.__all__, "ogmkit.torch": torch_names(), "ogmkit.errors": classes}
    parts = ["# Public names", "", "Out of the docstrings; [Python](../api.md) shows how they go together."]
    for room, names in rooms.items():
        parts += ["", f"## {room}"]
        for name in names:
            parts += ["", f"::: {room}.{name}"]
    return "\n".join(parts) + "\n"


def torch_names() -> list[str]:
    """`ogmkit.torch.__all__`, read without torch."""
    tree = ast.parse(Path(ogmkit.__file__).with_name("torch.py").read_text("utf-8"))
    (listed,) = (
        node.value
        for node in tree.body
        if isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == "__all__"
    )
    names: list[str] = ast.literal_eval(listed)
    return names
