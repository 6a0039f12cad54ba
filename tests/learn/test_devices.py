"""What processes side by side have of a machine."""

import pytest

torch = pytest.importorskip("torch", reason="torch is not installed: pip install 'ogmkit[train]'")

from ogmkit.learn.devices import shares  # noqa: E402  # needs torch


@pytest.mark.parametrize(
    ("visible", "gpus"),
    [(None, ["0", "1", "2", "0"]), ("5,7", ["5", "7", "5", "7"]), ("GPU-a", ["GPU-a"] * 4)],
)
def test_each_has_a_gpu_in_turns(monkeypatch, visible, gpus):
    monkeypatch.setattr(torch.cuda, "is_available", lambda: True)
    monkeypatch.setattr(torch.cuda, "device_count", lambda: 3)
    monkeypatch.delenv("CUDA_VISIBLE_DEVICES", raising=False)
    if visible is not None:
        monkeypatch.setenv("CUDA_VISIBLE_DEVICES", visible)
    assert [one["CUDA_VISIBLE_DEVICES"] for one in shares(4)] == gpus


@pytest.mark.parametrize(("said", "count", "threads"), [(None, 2, "4"), (None, 20, "1"), ("3", 2, "3")])
def test_without_gpus_each_has_its_part_of_the_cores(monkeypatch, said, count, threads):
    monkeypatch.setattr(torch.cuda, "is_available", lambda: False)
    monkeypatch.setattr(torch, "get_num_threads", lambda: 8)
    monkeypatch.delenv("OMP_NUM_THREADS", raising=False)
    if said is not None:
        monkeypatch.setenv("OMP_NUM_THREADS", said)
    assert shares(count) == ({"OMP_NUM_THREADS": threads},) * count
