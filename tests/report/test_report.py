"""Reports of shards, trainings and tables, as files."""

import json
import re

import pytest

from ogmkit.errors import OutputError, SettingsError, TableError, UnreadableShardError
from ogmkit.report import soundness
from ogmkit.report.report import Means, write_report
from ogmkit.report.scores import read_scores
from ogmkit.report.settings import ReportSettings
from ogmkit.report.sources import sources_of
from ogmkit.report.trainings import curves_of, differing, read_trainings
from ogmkit.shards.faults import MAY_BE_SOUND
from ogmkit.shards.manifest import read_manifest
from ogmkit.shards.verify import Problem

QUICK = ReportSettings(frames=2, no_verify=True, no_check=True)
FIGURES = "epoch,step,name,value\n0,4,train/loss,2\n0,4,val/iou,0.25\n1,8,train/loss,1\n1,8,val/iou,0.5\n"


def write(path, sources, settings=QUICK, **means):
    write_report(path, sources_of(sources), settings, Means(**means))
    return path.read_text(encoding="utf-8")


def record(system, value, **more):
    interval = {"value": value, "low": value and value - 0.05, "high": value and value + 0.1}
    seen = {"chosen_on_reported": system == "oft", "learnt_from_reported": False}
    return {"system": system, "definition": "paper"} | more | interval | seen


@pytest.fixture
def table(tmp_path):
    """A table of grids with three rows, as `evaluate --format json` writes it."""
    column = {
        "target": "drivable",
        "view": "bev",
        "region": "full",
        "cells": "all",
        "metric": "foreground_iou",
    }
    other = column | {"view": "camera"}
    rows = [("oft", 0.5), ("footprints", 0.75), ("all-drivable", 0.25)]
    records = [record(name, value, **column) for name, value in rows]
    records += [record(name, None, **other) for name, _ in rows]
    path = tmp_path / "perception.json"
    path.write_text(json.dumps(records))
    return path


@pytest.fixture
def make_training(tmp_path):
    """Write a RUN without a checkpoint: `make_training(name, **settings)`."""
    pytest.importorskip("yaml", reason="YAML is not installed: pip install 'ogmkit[train]'")

    def make(name, **settings):
        run = tmp_path / "runs" / name
        run.mkdir(parents=True)
        stated = {"system": "oft", "epochs": 2} | settings
        (run / "config.yaml").write_text("".join(f"{key}: {value}\n" for key, value in stated.items()))
        (run / "splits.json").write_text('{"train": ["a", "b"], "val": ["c"]}')
        (run / "metrics.csv").write_text(FIGURES)
        return run

    return make


def test_the_same_shards_give_the_same_page(sample_shards, tmp_path):
    one = write(tmp_path / "one.html", [sample_shards])
    assert one == write(tmp_path / "other.html", [sample_shards], workers=2)
    assert [path.name for path in sorted(tmp_path.iterdir())] == ["one.html", "other.html"]


def test_it_says_what_was_extracted_and_how_many_frames_are_pictured(sample_shards, tmp_path):
    page = write(tmp_path / "report.html", [sample_shards])
    assert "60 × 40 cells of 0.5 m, 30 × 20 m" in page
    assert "At most 2 of each scene" in page
    assert "not verified" in page
    assert "not checked" in page
    assert page.count('<script type="text/plain"') == len(read_manifest(sample_shards).shards)


def test_nothing_in_it_leads_elsewhere(sample_shards, tmp_path):
    page = write(tmp_path / "report.html", [sample_shards])
    links = re.findall(r'(?:src|href|action|srcset)="([^"]*)"', page)
    assert links
    assert all(link.startswith("#") for link in links)
    assert "url(" not in page
    assert set(re.findall(r"https?://[^\s\"']+", page)) <= {"http://www.w3.org/2000/svg"}


def test_findings_of_verify_and_check(copied_shards, tmp_path):
    (copied_shards / "stray.h5").write_bytes(b"no shard")
    page = write(tmp_path / "report.html", [copied_shards], ReportSettings(frames=1, no_check=False))
    assert "1 problem" in page or "2 problems" in page
    assert "stray.h5" in page
    assert "ogmkit check: numbered rules" in page


def test_progress_ends_where_it_is_said_to(sample_shards, tmp_path):
    told = []
    write(
        tmp_path / "report.html",
        [sample_shards],
        ReportSettings(frames=1, no_check=True),
        on_progress=lambda *counts: told.append(counts),
    )
    assert told == [(1, 4), (2, 4), (3, 4), (4, 4)]


def test_names_from_the_data_are_text(hostile_shards, hostile_scene, tmp_path):
    page = write(tmp_path / "report.html", [hostile_shards])
    assert hostile_scene not in page
    assert "<img" not in page
    assert "<b onclick" not in page
    (data,) = re.findall(r'id="frames-data">(.*?)</script>', page, re.DOTALL)
    assert json.loads(data)["scenes"][0] == hostile_scene
    assert any("<b onclick=x>too few</b>" in lack for lack in json.loads(data)["lacks"])


def test_tables_are_read_with_their_intervals(table):
    (headline,) = read_scores(table)
    assert headline.title == "Foreground IoU in %, all cells"
    assert headline.groups == (("drivable", 2),)
    assert headline.columns == ("BEV full", "camera")
    assert headline.flattered == {"oft"}
    full, camera = headline.rows["footprints"]
    assert (full.value, full.low, full.high) == pytest.approx((75, 70, 85))
    assert camera.value != camera.value


def test_plans_have_a_column_for_each_horizon(tmp_path):
    records = [
        record("lstm-ed", 1.5 * horizon, metric="ade", horizon_s=horizon, reading="at")
        for horizon in (0.5, 2.5)
    ]
    path = tmp_path / "plans.json"
    path.write_text(json.dumps(records))
    (table,) = read_scores(path)
    assert (table.title, table.columns, table.plans) == ("ADE in m, at the horizon", ("0.5 s", "2.5 s"), True)
    page = write(tmp_path / "report.html", [path])
    assert 'id="planning"' in page
    assert "plans.json. Lines are 95 % intervals" in page


def test_a_page_of_a_table_alone(table, tmp_path):
    page = write(tmp_path / "report.html", [table])
    assert "oft *" in page
    assert 'data-v="75"' in page
    # the column runs from 20 to 85: the figure lies at 85 %, the interval from 77 to 100 %
    assert '<i style="left:76.9%;width:23.1%"></i><b style="left:84.6%"></b>' in page


@pytest.mark.parametrize("content", ["{", "3", '{"a": 1}', '[{"metric": "ade"}]', '[{"value": 1}]'])
def test_what_is_no_table_is_refused(content, tmp_path):
    path = tmp_path / "table.json"
    path.write_text(content)
    with pytest.raises(TableError, match=r"table\.json: is no table.*evaluate --format json"):
        read_scores(path)


def test_curves_and_differences_of_trainings(make_training, tmp_path):
    runs = [make_training("one", lr=0.1), make_training("other", lr=0.2)]
    trainings = read_trainings(runs)
    assert [one.name for one in trainings] == ["one", "other"]
    assert trainings[0].curves == {"train/loss": ((4, 2.0), (8, 1.0)), "val/iou": ((4, 0.25), (8, 0.5))}
    assert trainings[0].scenes == {"train": 2, "val": 1}
    assert differing(trainings) == {"lr": ("0.1", "0.2")}
    page = write(tmp_path / "report.html", runs)
    assert page.index("val/iou") < page.index("train/loss")
    assert page.count('class="line s1"') == 2
    assert "Settings in which they differ: 1" in page


def test_no_figure_no_curve():
    assert curves_of(()) == {}


def test_what_a_path_is(sample_shards, table, make_training, tmp_path):
    run = make_training("one")
    found = sources_of([sample_shards, run, run, table])
    assert (found.shards, found.runs, found.tables) == (sample_shards, (run,), (table,))
    with pytest.raises(SettingsError, match="neither shards, a RUN"):
        sources_of([tmp_path])


def test_two_folders_of_shards_are_refused(sample_shards, copied_shards):
    with pytest.raises(SettingsError, match="one folder of shards"):
        sources_of([sample_shards, copied_shards])


def test_it_stays_out_of_the_shards(copied_shards):
    with pytest.raises(OutputError, match="holds nothing but shards"):
        write(copied_shards / "report.html", [copied_shards])


def test_a_folder_that_is_not_there(sample_shards, tmp_path):
    with pytest.raises(OutputError, match=r"absent/report\.html: can't be written"):
        write(tmp_path / "absent" / "report.html", [sample_shards])


def test_what_fails_leaves_what_was_there(copied_shards, tmp_path):
    path = tmp_path / "report.html"
    path.write_text("old")
    next(copied_shards.glob("*.h5")).unlink()
    with pytest.raises(Exception, match="is absent"):
        write(path, [copied_shards])
    assert path.read_text() == "old"
    assert "report.html" in {one.name for one in tmp_path.iterdir()}
    assert not [one for one in tmp_path.iterdir() if one.name.endswith(".part")]


def test_interrupted_it_leaves_nothing(sample_shards, tmp_path):
    def interrupt(done, total):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        write(tmp_path / "report.html", [sample_shards], on_progress=interrupt)
    assert list(tmp_path.iterdir()) == []


def test_what_the_system_refuses_to_read_is_no_finding(copied_shards, tmp_path, monkeypatch):
    refused = Problem("scene-0001.h5", f"can't be read (Input/output error); {MAY_BE_SOUND}: check the disk")
    monkeypatch.setattr(soundness, "verify_folder", lambda *arguments, **options: (refused,))
    with pytest.raises(UnreadableShardError, match=r"scene-0001\.h5: can't be read"):
        write(tmp_path / "report.html", [copied_shards], ReportSettings(no_check=True))
