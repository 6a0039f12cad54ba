"""What an installation has and lacks: found, counted, and told."""

import configparser
import json
import platform
from importlib import metadata
from pathlib import Path

import cv2
import numpy as np
import pytest
from click.testing import CliRunner
from ogmkit_cli.main import main

from ogmkit import __version__
from ogmkit.doctor import decoders, machine, packages
from ogmkit.doctor.decoders import Decoder
from ogmkit.doctor.machine import Machine
from ogmkit.doctor.packages import Lack, lacks, package_of, satisfies


def doctor(*arguments):
    return CliRunner().invoke(main, ["doctor", *arguments])


@pytest.fixture(autouse=True)
def quick(monkeypatch, tmp_path):
    """Without torch, whose import takes seconds, and with a cache of its own."""
    monkeypatch.setattr(machine, "_devices", lambda: ("cpu (2 threads, 32-true)",))
    monkeypatch.setenv("OGMKIT_CACHE_DIR", str(tmp_path / "far" / "cache"))


def without(monkeypatch, *names):
    """Make packages absent."""
    whole = metadata.version

    def version(name):
        if name in names:
            raise metadata.PackageNotFoundError(name)
        return whole(name)

    monkeypatch.setattr(packages.metadata, "version", version)


@pytest.mark.parametrize(
    ("installed", "asked", "sound"),
    [
        ("1.26", ">=1.26", True),
        ("1.26.0", ">=1.26", True),
        ("1.9", ">=1.26", False),
        ("2.0.0rc1", ">=2.0", True),
        ("2.14.1+cu130", "<3,>=2.5", True),
        ("10.0", ">=9.9", True),
        ("0.1", "", True),
    ],
)
def test_releases_are_compared_by_their_numbers(installed, asked, sound):
    assert satisfies(installed, asked) == sound


def test_requirements_are_read_as_metadata_has_them(monkeypatch):
    without(monkeypatch, "torch")
    torch = package_of('torch>=2.5; extra == "train"')
    numpy = package_of("numpy (>=1.26)")

    assert (torch.name, torch.installed, torch.asked, torch.extra, torch.sound) == (
        *("torch", None, ">=2.5", "train"),
        False,
    )
    assert (numpy.name, numpy.installed, numpy.extra, numpy.sound) == ("numpy", np.__version__, "", True)


def test_what_is_missing_is_told_by_what_it_is_for(monkeypatch):
    without(monkeypatch, "torch", "kornia", "click")
    found = [
        package_of(one) for one in ("click>=8", 'torch>=2; extra == "train"', 'kornia; extra == "train"')
    ]

    assert lacks(found) == (
        Lack("", ("click",), "everything", "pip install --upgrade 'ogmkit'"),
        Lack("train", ("torch", "kornia"), packages.USES["train"], "pip install --upgrade 'ogmkit[train]'"),
    )


def test_every_extra_but_those_of_development_has_its_use():
    config = configparser.ConfigParser()
    config.read(Path(__file__).resolve().parents[2] / "setup.cfg")

    others = {"dev", "docs", "mutants"}
    assert set(config["options.extras_require"]) - others == set(packages.USES) - {packages.CORE}


def test_every_decoder_works_here():
    found = decoders.decoders()

    assert {one.problem for one in found} == {""}
    assert {one.name for one in found} == {"JPEG", "JPEG at an eighth", "PNG", "shards, gzip", "shards, lzf"}
    assert any(one.library == f"OpenCV {cv2.__version__}" for one in found)


def test_a_decoder_that_fails_or_lies_is_named(monkeypatch):
    def broken(*arguments):
        raise RuntimeError("no codec")

    monkeypatch.setattr(decoders.cv2, "imdecode", broken)
    problems = {(one.name, one.library): one.problem for one in decoders.decoders()}
    assert problems["PNG", f"OpenCV {cv2.__version__}"] == "RuntimeError: no codec"
    assert sum(map(bool, problems.values())) == 3
    monkeypatch.setattr(decoders.cv2, "imdecode", lambda *arguments: np.zeros((64, 64, 3), np.uint8))
    problems = {(one.name, one.library): one.problem for one in decoders.decoders()}
    assert problems["PNG", f"OpenCV {cv2.__version__}"] == "gives other pixels than it was given"


def test_text_names_versions_machine_disks_and_cache(tmp_path):
    result = doctor()

    assert result.exit_code == 0, result.output
    lines = result.stdout.splitlines()
    assert lines[0].startswith(f"ogmkit {__version__}, Python {platform.python_version()} ")
    assert lines[2] == "devices: cpu (2 threads, 32-true)"
    assert f"OGMKIT_CACHE_DIR={tmp_path / 'far' / 'cache'}" in lines[3]
    assert any(line.split()[:2] == ["numpy", np.__version__] for line in lines)
    assert sum(line.endswith("works") for line in lines) == 6
    (disk,) = (line for line in lines if line.startswith("cache  "))
    assert f" {tmp_path} " in disk  # the nearest folder that there is
    assert f"cache: {tmp_path / 'far' / 'cache'}, 0 decoded map masks, 0.0 GiB" in lines
    assert not (tmp_path / "far").exists()


def test_json_has_the_fields_that_help_names():
    held = json.loads(doctor("--json").stdout)

    assert set(held) == {"ogmkit", "machine", "packages", "decoders", "disks", "cache", "lacks"}
    assert set(held["machine"]) == set(Machine.__dataclass_fields__)
    assert held["disks"][0]["folder"] == str(Path.cwd())
    assert all(0 < one["free_bytes"] <= one["total_bytes"] for one in held["disks"])
    assert {one["extra"] for one in held["packages"]} <= set(packages.USES)
    assert {"numpy", "h5py"} <= {one["name"] for one in held["packages"]}


def test_a_lack_is_an_exit_code_only_where_the_core_has_it(monkeypatch):
    without(monkeypatch, "torch")
    result = doctor()
    assert result.exit_code == 0
    assert "lacks torch: for train, adapt," in result.stdout
    without(monkeypatch, "shapely")
    result = doctor()
    assert result.exit_code == 1
    assert "lacks shapely: for everything; pip install --upgrade 'ogmkit'" in result.stdout


def test_a_broken_decoder_is_an_exit_code(monkeypatch):
    monkeypatch.setattr(
        "ogmkit.doctor.report.decoders", lambda: (Decoder("JPEG", "OpenCV 5", "RuntimeError: no codec"),)
    )
    result = doctor()
    assert result.exit_code == 1
    assert "RuntimeError: no codec" in result.stdout
