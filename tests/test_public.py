"""The public face: what `import ogmkit` and `ogmkit.torch` offer, as docs/api.md has it."""

import ast
import importlib.util
import re
from pathlib import Path

import pytest

import ogmkit

ROOT = Path(__file__).resolve().parents[1]
PAGE = (ROOT / "docs" / "api.md").read_text(encoding="utf-8")
BLOCKS = re.findall(r"^```python\n(.*?)^```", PAGE, re.MULTILINE | re.DOTALL)
WITHOUT_TORCH = importlib.util.find_spec("torch") is None
needs_torch = pytest.mark.skipif(WITHOUT_TORCH, reason="torch is not installed: pip install 'ogmkit[train]'")


def typed_imports():
    """What type checkers see: (module below ogmkit, name) of the imports under TYPE_CHECKING."""
    tree = ast.parse(Path(ogmkit.__file__).read_text(encoding="utf-8"))
    (block,) = (node for node in tree.body if isinstance(node, ast.If))
    return {(one.module.removeprefix("ogmkit."), alias.name) for one in block.body for alias in one.names}


def test_names_are_sorted_and_what_type_checkers_see():
    assert ogmkit.__all__ == sorted(set(ogmkit.__all__))
    assert {name for _, name in typed_imports()} == set(ogmkit.__all__)
    assert {(module, name) for module, names in ogmkit._HOMES.items() for name in names} == typed_imports()


@pytest.mark.parametrize("name", ogmkit.__all__)
def test_each_name_is_there_and_described(name):
    value = getattr(ogmkit, name)
    # A dataclass without a docstring has its signature for one.
    assert value.__doc__
    assert not value.__doc__.startswith(f"{name}(")
    assert f"`{name}" in PAGE
    assert name in dir(ogmkit)


def test_another_name_is_no_attribute():
    with pytest.raises(AttributeError, match="module 'ogmkit' has no attribute 'Datset'"):
        ogmkit.Datset  # noqa: B018


@needs_torch
def test_the_names_for_torch_are_there_and_described():
    import ogmkit.torch

    assert ogmkit.torch.__all__ == sorted(set(ogmkit.torch.__all__))
    for name in ogmkit.torch.__all__:
        assert getattr(ogmkit.torch, name).__doc__
        assert f"`{name}" in PAGE


def test_the_page_s_blocks_run_one_after_the_other(tiny_dataroot, tmp_path, monkeypatch, capsys):
    (tmp_path / "dataroot").symlink_to(tiny_dataroot)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    names = {}
    for block in BLOCKS:
        if not (WITHOUT_TORCH and "ogmkit.torch" in block):
            exec(compile(block, "docs/api.md", "exec"), names)

    assert len(BLOCKS) >= 6
    assert ogmkit.verify_folder(tmp_path / "shards") == ()
    assert capsys.readouterr().out
