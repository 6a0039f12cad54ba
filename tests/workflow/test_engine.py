"""Steps in order, cut short at every moment, with settings that change in between."""

import hashlib
import itertools
import time
from contextlib import suppress
from dataclasses import dataclass, field, replace
from pathlib import Path

import pytest

from ogmkit.errors import ShardError, TrainingError
from ogmkit.workflow import engine
from ogmkit.workflow.engine import plan_steps, run_steps
from ogmkit.workflow.records import NAME, read_records, write_records
from ogmkit.workflow.steps import Made, first_gone, letting_go


class Killed(BaseException):
    """As a process that is gone: nothing handles it."""


class Clock:
    """Counts moments, and ends the process at one of them."""

    def __init__(self):
        self.moment, self.last, self.done = 0, None, []
        self.luck = 0  # what trainings on a GPU depend on

    def tick(self):
        if self.moment == self.last:
            raise Killed
        self.moment += 1

    def until(self, last):
        self.moment, self.last, self.done = 0, last, []
        return self


@dataclass(frozen=True)
class Careless:
    """A step that takes whatever it finds for its own, unless it is told to overwrite.

    It writes its settings first and the files of what it needs then, so that its file tells whether anything
    in it is of another time.
    """

    out: Path
    clock: Clock
    name: str
    needs: tuple[str, ...] = ()
    settings: dict = field(default_factory=dict)
    exact: bool = True
    lets_go: bool = False

    @property
    def file(self):
        return f"{self.name}.txt"

    def missing(self, files):
        return first_gone(self.out, files)

    def run(self, call):
        path, part = self.out / self.file, self.out / f"{self.name}.half"
        self.clock.done.append(self.name)
        if call.overwrite:
            for old in (part, path):
                self.clock.tick()
                old.unlink(missing_ok=True)
            if self.lets_go:
                self.clock.tick()
                call.let_go()
        if not path.exists():
            self.clock.tick()
            if not part.exists():
                luck = "" if self.exact else f" {self.clock.luck}"
                part.write_text(f"{self.settings}{luck}\n")
            call.advance(1, 2)
            self.clock.tick()
            inputs = "".join((self.out / f"{need}.txt").read_text() for need in self.needs)
            path.write_text(part.read_text() + inputs)
            part.unlink()
        self.clock.tick()
        text = path.read_text()
        identity = "" if self.exact else hashlib.sha256(text.encode()).hexdigest()
        return Made((self.file,), note=self.name, identity=identity)


def chain(out, clock, **settings):
    """Shards, a training on them, what is predicted by it, a second training, a table of all."""

    def own(name):
        return {"value": settings.get(name, 0)}

    return (
        Careless(out, clock, "shards", (), own("shards"), lets_go=True),
        Careless(out, clock, "network", ("shards",), own("network"), exact=False, lets_go=True),
        Careless(out, clock, "predicted", ("shards", "network"), own("predicted")),
        Careless(out, clock, "planner", ("shards",), own("planner"), exact=False, lets_go=True),
        Careless(out, clock, "table", ("predicted", "planner"), own("table")),
    )


@pytest.fixture
def clock(monkeypatch):
    """Moments before and after each writing of the manifest count as well."""
    clock = Clock()

    def write(out, records):
        clock.tick()
        write_records(out, records)
        clock.tick()

    monkeypatch.setattr(engine, "write_records", write)
    monkeypatch.setattr("ogmkit.base.atomic._sync", lambda path: None)  # nobody cuts the power
    return clock


def content(out):
    return {path.name: path.read_text() for path in out.iterdir() if path.name != NAME}


def undisturbed(folder, clock, **settings):
    folder.mkdir()
    run_steps(folder, chain(folder, clock.until(None), **settings))
    return content(folder), clock.moment


def cut_short(out, clock, moment, **settings):
    with pytest.raises(Killed):
        run_steps(out, chain(out, clock.until(moment), **settings))


def test_killed_at_any_moment_it_ends_as_if_undisturbed(tmp_path, clock):
    expected, moments = undisturbed(tmp_path / "whole", clock)
    assert moments > 20
    for moment in range(moments):
        out = tmp_path / str(moment)
        out.mkdir()
        cut_short(out, clock, moment)
        run_steps(out, chain(out, clock.until(None)))
        assert content(out) == expected, moment


def test_killed_while_settings_change_it_never_takes_old_for_new_or_new_for_old(tmp_path, clock):
    before, after = {"shards": 1}, {"shards": 2, "table": 5}
    new, _ = undisturbed(tmp_path / "new", clock, **after)
    old, _ = undisturbed(tmp_path / "old", clock, **before)
    out = tmp_path / "run"
    out.mkdir()
    run_steps(out, chain(out, clock.until(None), **before))
    run_steps(out, chain(out, clock.until(None), **after))
    for moment, back in itertools.product(range(clock.moment), (False, True)):
        run_steps(out, chain(out, clock.until(None), **before))
        assert content(out) == old, moment
        cut_short(out, clock, moment, **after)
        if back:  # and the old settings again, cut short as well
            with suppress(Killed):  # unless nothing had been touched yet
                run_steps(out, chain(out, clock.until(min(moment, 3)), **before))
            run_steps(out, chain(out, clock.until(None), **after))
            assert content(out) == new, moment


def test_it_goes_on_once_the_old_is_gone_and_begins_anew_before(tmp_path, clock):
    for lets_go, actions in ((True, {"overwrite", "resume"}), (False, {"overwrite"})):
        steps = [
            (Careless(tmp_path, clock, f"s{lets_go}", (), {"value": value}, lets_go=lets_go),)
            for value in (0, 1)
        ]
        found = []
        for moment in itertools.count():
            run_steps(tmp_path, (clock.until(None), steps[0])[1])
            try:
                run_steps(tmp_path, (clock.until(moment), steps[1])[1])
            except Killed:
                found.append(plan_steps(tmp_path, steps[1])[0].action)
            else:
                break
        assert found[0] == "overwrite"
        assert found[-1] == "skip"  # killed after the last writing
        assert set(found[:-1]) == actions
        assert found == sorted(found, key=["overwrite", "resume", "skip"].index)


@pytest.mark.parametrize(
    ("changed", "done"),
    [
        ({}, []),
        ({"table": 1}, ["table"]),
        ({"planner": 1}, ["planner", "table"]),
        ({"network": 1}, ["network", "predicted", "table"]),
        ({"shards": 1}, ["shards", "network", "predicted", "planner", "table"]),
    ],
)
def test_a_change_does_anew_what_depends_on_it_and_says_so_before(tmp_path, clock, changed, done):
    run_steps(tmp_path, chain(tmp_path, clock.until(None)))
    assert len(clock.done) == 5
    steps = chain(tmp_path, clock.until(None), **changed)
    planned = dict(zip([step.name for step in steps], plan_steps(tmp_path, steps), strict=True))
    assert [name for name, decision in planned.items() if decision.action != "skip"] == done
    for name in changed:
        assert planned[name].reason == "value is 1 here but 0 there"
    run_steps(tmp_path, steps)
    assert clock.done == done


def test_a_step_that_is_new_changes_what_needs_it_only(tmp_path, clock):
    *others, table = chain(tmp_path, clock.until(None))
    run_steps(tmp_path, (*others, table))
    more = Careless(tmp_path, clock, "more", ("shards",))
    steps = (*others, more, replace(table, needs=(*table.needs, "more")))
    reasons = {s.name: d.reason for s, d in zip(steps, plan_steps(tmp_path, steps), strict=True)}
    assert (reasons["more"], reasons["table"]) == ("not done yet", "more has changed")
    clock.until(None)
    run_steps(tmp_path, steps)
    assert clock.done == ["more", "table"]
    clock.until(None)
    without = (*others, table)
    assert plan_steps(tmp_path, without)[-1].reason == "more is no longer needed"
    run_steps(tmp_path, without)
    assert clock.done == ["table"]
    assert "more" in read_records(tmp_path)


def test_another_version_of_the_package_does_all_anew(tmp_path, clock, monkeypatch):
    run_steps(tmp_path, chain(tmp_path, clock.until(None)))
    for module in ("records", "steps"):
        monkeypatch.setattr(f"ogmkit.workflow.{module}.__version__", "99")
    first, *_ = plan_steps(tmp_path, chain(tmp_path, clock))
    assert first.action == "overwrite"
    assert first.reason.startswith("made by ogmkit ")


@pytest.mark.parametrize(
    ("name", "action", "done"),
    [("shards", "resume", ["shards"]), ("planner", "overwrite", ["planner"]), ("table", "resume", ["table"])],
)
def test_what_is_gone_comes_back(tmp_path, clock, name, action, done):
    run_steps(tmp_path, chain(tmp_path, clock.until(None)))
    expected = content(tmp_path)
    (tmp_path / f"{name}.txt").unlink()
    steps = chain(tmp_path, clock.until(None))
    decisions = {step.name: one for step, one in zip(steps, plan_steps(tmp_path, steps), strict=True)}
    assert (decisions[name].action, decisions[name].reason) == (action, f"{name}.txt is gone")
    run_steps(tmp_path, steps)
    assert (clock.done, content(tmp_path)) == (done, expected)


@pytest.mark.parametrize(("luck", "done"), [(0, []), (1, ["predicted", "table"])])
def test_a_training_that_comes_out_otherwise_is_another(tmp_path, clock, luck, done):
    steps = chain(tmp_path, clock.until(None))
    run_steps(tmp_path, steps)
    (tmp_path / "network.txt").unlink()
    clock.until(None).luck = luck
    run_steps(tmp_path, steps)
    assert clock.done == ["network", *done]


def test_files_that_are_made_no_more_are_removed(tmp_path):
    @dataclass(frozen=True)
    class Pictures(Careless):
        def run(self, call):
            for file in self.settings["files"]:
                (self.out / file).touch()
            return Made(tuple(self.settings["files"]))

    (tmp_path / "notes.txt").touch()
    for files in (["a", "b"], ["b", "c"]):
        run_steps(tmp_path, (Pictures(tmp_path, Clock(), "draw", (), {"files": files}),))
    assert {path.name for path in tmp_path.iterdir()} == {"b", "c", "notes.txt", NAME}


def test_a_failure_names_its_step_and_the_rest_waits(tmp_path, clock):
    @dataclass(frozen=True)
    class Failing(Careless):
        def run(self, call):
            raise TrainingError("loss is not finite; lower lr")

        def missing(self, files):
            raise ShardError("damaged")

    first, second, *rest = chain(tmp_path, clock.until(None))
    failing = Failing(tmp_path, clock, "network", ("shards",), {"value": 0})
    with pytest.raises(TrainingError, match=r"^network: loss is not finite; lower lr$"):
        run_steps(tmp_path, (first, failing, *rest))
    assert clock.done == ["shards"]
    clock.until(None)
    run_steps(tmp_path, (first, second, *rest))
    assert clock.done[0] == "network"
    with pytest.raises(ShardError, match=r"^network: damaged$"):
        run_steps(tmp_path, (first, failing, *rest))
    with pytest.raises(ShardError, match=r"^network: damaged$"):
        plan_steps(tmp_path, (first, failing, *rest))


def test_news_of_steps_and_progress_come_in_order(tmp_path, clock):
    news, progress = [], []
    steps = chain(tmp_path, clock.until(None))[:2]

    def tell(report):
        news.append((report.name, report.number, report.total, report.state, report.detail))

    run_steps(tmp_path, steps, on_step=tell, on_progress=lambda *done: progress.append(done))
    assert news == [
        ("shards", 1, 2, "begun", "not done yet"),
        ("shards", 1, 2, "done", "shards"),
        ("network", 2, 2, "begun", "not done yet"),
        ("network", 2, 2, "done", "network"),
    ]
    assert progress == [(1, 2), (1, 2)]
    news.clear()
    run_steps(tmp_path, steps, on_step=tell)
    assert [(name, state) for name, _, _, state, _ in news] == [("shards", "skipped"), ("network", "skipped")]


def test_planning_writes_nothing(tmp_path, clock):
    decisions = plan_steps(tmp_path, chain(tmp_path, clock.until(0)))
    assert [(one.action, one.reason) for one in decisions] == [
        ("start", "not done yet"),
        ("start", "not done yet"),
        ("start", "after network"),
        ("start", "not done yet"),
        ("start", "after predicted"),
    ]
    assert list(tmp_path.iterdir()) == []


@dataclass(frozen=True)
class Separate:
    """A step for any process: its file tells what it read, and which place it was done at.

    It can wait for another one to be under way, fail, or be stopped.
    """

    out: Path
    name: str
    needs: tuple[str, ...] = ()
    settings: dict = field(default_factory=dict)
    exact: bool = True
    awaited: str = ""
    fails: bool = False

    def missing(self, files):
        return first_gone(self.out, files)

    def run(self, call):
        return self.made(self.work(overwrite=call.overwrite)(letting_go(call)))

    def work(self, *, overwrite):
        return SeparateWork(self, overwrite)

    def made(self, result):
        return Made((f"{self.name}.txt",), note=f"{result} bytes")


@dataclass(frozen=True)
class SeparateWork:
    """What such a step does."""

    step: Separate
    overwrite: bool

    def __call__(self, on_progress):
        step = self.step
        path = step.out / f"{step.name}.txt"
        if self.overwrite:
            path.unlink()
        on_progress(1, 4)
        (step.out / f"{step.name}.begun").touch()
        while step.awaited and not (step.out / f"{step.awaited}.begun").exists():
            time.sleep(0.02)
        if step.fails:
            raise TrainingError("no luck")
        read = [(step.out / f"{need}.txt").read_text() for need in step.needs]
        path.write_text(f"{step.name} {step.settings}\n" + "".join(read))
        return path.stat().st_size


@pytest.fixture
def _importable(monkeypatch):
    """What is in this file can be imported by processes that are started."""
    monkeypatch.syspath_prepend(Path(__file__).resolve().parents[2])


TWO = ({"OMP_NUM_THREADS": "1"}, {"OMP_NUM_THREADS": "1"})


def separate(out, **changes):
    """Two that wait for each other, one that needs the first of them, one that needs nothing."""
    waiting = {"a": "b", "b": "a"}
    needs = {"c": ("a",)}
    return tuple(
        replace(
            Separate(out, name, needs.get(name, ()), awaited=waiting.get(name, "")), **changes.get(name, {})
        )
        for name in "abcd"
    )


@pytest.mark.usefixtures("_importable")
def test_separate_steps_go_on_side_by_side_in_as_many_processes_as_there_are_places(tmp_path):
    told, counts = [], []
    steps = separate(tmp_path)
    run_steps(tmp_path, steps, places=TWO, on_step=told.append, on_progress=lambda *one: counts.append(one))
    assert (tmp_path / "c.txt").read_text() == "c {}\na {}\n"
    begun = [one.name for one in told if one.state == "begun"]
    assert begun == ["a", "b", "c", "d"]
    under_way = 0
    for one in told:
        under_way += 1 if one.state == "begun" else -1
        assert under_way <= 2
    assert told.index(next(one for one in told if one.name == "c" and one.state == "begun")) > told.index(
        next(one for one in told if one.name == "a" and one.state == "done")
    )
    assert (2, 8) in counts  # of two that are under way
    assert all(record.state == "done" for record in read_records(tmp_path).values())
    again = []
    run_steps(tmp_path, steps, places=TWO, on_step=again.append)
    assert {one.state for one in again} == {"skipped"}


def test_one_place_does_all_in_order_here(tmp_path, monkeypatch):
    monkeypatch.setattr(engine, "SideBySide", None)
    steps = separate(tmp_path, a={"awaited": ""}, b={"awaited": ""})
    run_steps(tmp_path, steps, places=TWO[:1])
    assert (tmp_path / "c.txt").read_text() == "c {}\na {}\n"


@pytest.mark.usefixtures("_importable")
def test_a_failure_of_one_leaves_what_is_done_and_the_same_call_resumes(tmp_path):
    steps = separate(tmp_path)
    with pytest.raises(TrainingError, match=r"^b: no luck$"):
        run_steps(tmp_path, separate(tmp_path, b={"fails": True}), places=TWO)
    assert read_records(tmp_path)["b"].state == "started"
    run_steps(tmp_path, steps, places=TWO)
    assert {path.name for path in tmp_path.glob("*.txt")} == {"a.txt", "b.txt", "c.txt", "d.txt"}


@pytest.mark.usefixtures("_importable")
def test_a_changed_setting_overwrites_side_by_side(tmp_path):
    run_steps(tmp_path, separate(tmp_path), places=TWO)
    for path in tmp_path.glob("*.begun"):
        path.unlink()
    run_steps(
        tmp_path, separate(tmp_path, a={"settings": {"value": 1}}, b={"settings": {"value": 2}}), places=TWO
    )
    assert (tmp_path / "c.txt").read_text() == "c {}\na {'value': 1}\n"
    assert (tmp_path / "b.txt").read_text() == "b {'value': 2}\n"
