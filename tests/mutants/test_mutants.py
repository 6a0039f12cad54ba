"""The tool itself, on a package of one function; and the list of mutants that no test can tell apart."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

HERE = Path(__file__).resolve().parent
PACKAGE = HERE.parents[1] / "ogmkit"
TOY = """def odd(n, unused=3):
    while n > 1:
        n = n - 2
    return n == 1
"""
TOY_TEST = """from ogmkit.toy import odd


def test_odd():
    assert [odd(n) for n in range(5)] == [False, True, False, True, False]
"""
TRY = """
import json, sys
from pathlib import Path
sys.path.insert(0, sys.argv[1])
from listing import mutants_of
from trial import Copy

root = Path(sys.argv[2])
copy = Copy(root / "copy", root)
copy.seconds("toy")
mutants = mutants_of("toy", (root / "ogmkit/toy.py").read_text())
source = (root / "ogmkit/toy.py").read_text()
chosen = {(m.before, m.after(source)): m for m in mutants}
lines = [tuple(pair) for pair in json.loads(sys.argv[3])]
print(json.dumps([copy.outcome(chosen[pair], 4.0) for pair in lines]))
assert (root / "copy/ogmkit/toy.py").read_text() == source
"""


@pytest.fixture
def toy(tmp_path):
    for folder in ("ogmkit", "cli", "tests", "fixtures"):
        (tmp_path / folder).mkdir()
    (tmp_path / "setup.cfg").write_text("[tool:pytest]\naddopts = --import-mode=importlib\n")
    (tmp_path / "ogmkit/__init__.py").touch()
    (tmp_path / "ogmkit/toy.py").write_text(TOY)
    (tmp_path / "tests/test_toy.py").write_text(TOY_TEST)
    return tmp_path


@pytest.mark.slow
def test_a_mutant_is_killed_or_survives_or_never_ends(toy):
    pytest.importorskip("cosmic_ray", reason="cosmic-ray is not installed: pip install 'ogmkit[mutants]'")
    lines = {
        ("n = n - 2", "n = n - 1"): "killed",
        ("def odd(n, unused=3):", "def odd(n, unused= 4):"): "survived",
        ("n = n - 2", "n = n * 2"): "timed_out",
        ("return n == 1", "return n != 1"): "killed",
    }
    command = [sys.executable, "-c", TRY, HERE, toy, json.dumps(list(lines))]
    shown = subprocess.run(command, capture_output=True, text=True, check=True).stdout

    assert json.loads(shown.splitlines()[-1]) == list(lines.values())
    assert (toy / "ogmkit/toy.py").read_text() == TOY


def test_a_sample_has_each_place_once_and_some_of_every_module(monkeypatch):
    pytest.importorskip("cosmic_ray", reason="cosmic-ray is not installed: pip install 'ogmkit[mutants]'")
    monkeypatch.syspath_prepend(HERE)
    from listing import mutants_of, sample

    mutants = [mutant for name in ("toy", "other") for mutant in mutants_of(name, TOY)]
    chosen = sample(mutants, 9, seed=0)

    assert len(chosen) == len({mutant.place for mutant in chosen}) == 9
    assert chosen == sample(mutants, 9, seed=0) != sample(mutants, 9, seed=1)
    assert all(sum(mutant.module == name for mutant in chosen) >= 4 for name in ("toy", "other"))
    # A line more above moves the sample and changes nothing else in it.
    moved = sample([*mutants_of("toy", "\n" + TOY), *mutants_of("other", TOY)], 9, seed=0)
    assert [(m.module, m.name, m.before) for m in moved] == [(m.module, m.name, m.before) for m in chosen]


def test_every_equal_mutant_is_of_a_line_that_stands_there_and_has_a_reason():
    entries = json.loads((HERE / "equal.json").read_text(encoding="utf-8"))
    for entry in entries:
        source = (PACKAGE / entry["module"]).with_suffix(".py").read_text(encoding="utf-8")
        assert entry["line"] in map(str.strip, source.splitlines()), entry
        assert entry["line"] not in entry["becomes"]
        assert entry["reason"]
    named = [(entry["module"], entry["line"], after) for entry in entries for after in entry["becomes"]]
    assert len(named) == len(set(named))
