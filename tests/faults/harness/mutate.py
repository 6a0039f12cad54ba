"""Ways to break a file, each by a random source and in place; the same source breaks it alike."""

import json
from collections.abc import Callable
from pathlib import Path
from random import Random
from typing import Any

import h5py
import numpy as np

Mutator = Callable[[Path, Random], None]

ODD: tuple[Any, ...] = (
    *(None, True, False, 0, -1, 1, 0.5, 2**31, 2**63, -(2**63), 10**30, 1e308, -1e308, 1e-308),
    *(float("nan"), float("inf"), -float("inf"), "", " ", "a\nb", "\0", "../..", "/etc/passwd", "é\ud800"),
    *("9" * 400, "NaN", "CAM_FRONT", "scene-0001", [], {}, [[]], [None], [0, 0], {"a": 1}, [[0.0] * 4] * 4),
)
"""Values that stand where others should."""
_LONGEST = 4096
_DEEP = 5000


def damage(path: Path, random: Random) -> None:
    """Bytes: flipped, cut, overwritten, moved, doubled, inserted, or none left."""
    data = bytearray(path.read_bytes())
    at = random.randrange(len(data) + 1)
    length = random.choice((1, 2, 8, 64, random.randrange(1, _LONGEST)))
    match random.randrange(8):
        case 0 | 1:
            flip(path, random)
            return
        case 2:
            del data[at:]
        case 3:
            data[at : at + length] = bytes(min(length, len(data) - at))
        case 4:
            data[at : at + length] = random.randbytes(min(length, len(data) - at))
        case 5:
            data[at:at] = data[at : at + length]
        case 6:
            del data[at : at + length]
        case 7:
            data[at:at] = random.randbytes(length)
    path.write_bytes(data)


def flip(path: Path, random: Random) -> None:
    """One bit."""
    data = bytearray(path.read_bytes())
    bit = random.randrange(8 * len(data))
    data[bit // 8] ^= 1 << bit % 8
    path.write_bytes(data)


def change_json(path: Path, random: Random) -> None:
    """One to three values of a JSON file."""
    content = json.loads(path.read_text(encoding="utf-8"))
    path.write_text(_dumped(changed(content, random), random), encoding="utf-8")


def change_yaml(path: Path, random: Random) -> None:
    """One to three values of a YAML file, or its text."""
    import yaml

    if random.random() < 0.3:
        _change_text(path, random)
        return
    content = changed(yaml.safe_load(path.read_text(encoding="utf-8")), random)
    path.write_text(yaml.safe_dump(content), encoding="utf-8")


def changed(content: Any, random: Random) -> Any:  # plain values
    """Plain values with one to three changes somewhere inside."""
    holder = [content]
    for _ in range(random.choice((1, 1, 1, 2, 3))):
        _change_one(holder, random)
    return holder[0] if holder else None


def _change_one(holder: Any, random: Random) -> None:
    """Descend by chance, then replace, remove, double or rename."""
    key = random.choice(list(holder) if isinstance(holder, dict) else range(len(holder)))
    while isinstance(holder[key], dict | list) and holder[key] and random.random() < 0.9:
        holder = holder[key]
        key = random.choice(list(holder) if isinstance(holder, dict) else range(len(holder)))
    match random.randrange(6):
        case 0 if isinstance(holder, dict) or len(holder) > 1:
            del holder[key]
        case 1 if isinstance(holder, list):
            holder.insert(key, holder[key])
        case 1:
            holder[f"{key}x"] = holder.pop(key)
        case 2 if isinstance(holder, list):
            holder[key] = holder[random.randrange(len(holder))]
        case 3 if isinstance(holder[key], int | float):
            holder[key] = holder[key] * random.choice((-1, 1e-9, 1e9, 1 + 1e-9))
        case _:
            holder[key] = random.choice(ODD)


def _dumped(content: Any, random: Random) -> str:
    text = json.dumps(content)
    return text if random.random() < 0.98 else "[" * _DEEP + text + "]" * _DEEP


def _change_text(path: Path, random: Random) -> None:
    text = path.read_text(encoding="utf-8")
    at = random.randrange(len(text))
    scrap = random.choice(
        ("\t", "{", "[", ": ", "- ", "&a ", "*a", "!!python/object:os.x ", "\0", "'", "|", "#")
    )
    path.write_text(text[:at] + scrap + text[at + random.randrange(2) :], encoding="utf-8")


def change_h5(path: Path, random: Random) -> None:
    """One object or attribute of a shard."""
    with h5py.File(path, "r+") as h5:
        names: list[str] = []
        h5.visit(names.append)
        name = random.choice(names)
        holder = h5[name]
        if random.random() < 0.3 and len(holder.attrs):
            _change_attribute(holder.attrs, random)
        elif isinstance(holder, h5py.Dataset) and random.random() < 0.7:
            _change_values(holder, random)
        else:
            _change_object(h5, name, random)


def _change_attribute(attributes: Any, random: Random) -> None:
    name = random.choice(list(attributes))
    if random.random() < 0.3:
        del attributes[name]
        return
    value = random.choice([value for value in ODD if isinstance(value, str | float | int) and value != "\0"])
    if isinstance(value, int) and abs(value) >= 2**63:
        value = float(value)
    attributes[name] = value.encode("utf-8", "backslashreplace") if isinstance(value, str) else value


def _change_values(dataset: Any, random: Random) -> None:
    if dataset.dtype.kind not in "fiub" or dataset.size == 0:
        return
    values = dataset[()]
    flat = np.atleast_1d(values).reshape(-1)
    some = [random.randrange(flat.size) for _ in range(random.choice((1, 1, 5, flat.size)))]
    with np.errstate(all="ignore"):
        flat[some] = np.array(random.choice((0, 1, -1, np.nan, np.inf, 1e30, 2**31))).astype(flat.dtype)
    dataset[...] = flat.reshape(values.shape) if values.shape else flat[0]


def _change_object(h5: Any, name: str, random: Random) -> None:
    shape = getattr(h5[name], "shape", None) or (2,)
    del h5[name]
    match random.randrange(7):
        case 0:
            return
        case 1:
            h5[name] = h5py.SoftLink(random.choice(("/", "/absent", name)))
        case 2:
            h5[name] = h5py.ExternalLink(random.choice(("absent.h5", "/etc/passwd")), "/")
        case 3:
            h5.create_group(name)
        case 4:
            h5[name] = np.zeros(shape[1:] or (1,), np.float32)
        case 5:
            h5[name] = np.full((*shape[:1], 3), "é".encode(), "S4")
        case 6:
            h5.create_dataset(name, (2**40, *shape[1:]), np.uint8, chunks=True)


def change_checkpoint(path: Path, random: Random) -> None:
    """Something that a checkpoint says of itself, or a weight; with the checksum that belongs to it."""
    import torch

    from ogmkit.learn.checkpoints import write_checkpoint

    content = torch.load(path, weights_only=True)
    if random.random() < 0.7:
        content["ogmkit"] = changed(content["ogmkit"], random)
    else:
        _change_weights(content, random)
    write_checkpoint(path, content)


def _change_weights(content: dict[str, Any], random: Random) -> None:
    import torch

    weights = content["state_dict"]
    name = random.choice(list(weights))
    match random.randrange(4):
        case 0:
            del weights[name]
        case 1:
            weights[name] = torch.zeros(random.choice(((), (0,), (3,), (1, 1, 1, 1, 1))))
        case 2:
            weights[f"{name}x"] = weights.pop(name)
        case 3:
            weights[name] = random.choice((None, 1.0, "a", [1]))


def disarrange(path: Path, random: Random) -> None:
    """A file of a folder is gone, has another's name, is a folder, a link to itself, or empty."""
    twin = path.with_name(random.choice(("0", "a b.jpg", "é.png", f"{path.stem}.JPEG", f".{path.name}")))
    match random.randrange(6):
        case 0:
            path.unlink()
        case 1:
            path.rename(twin)
        case 2:
            path.unlink()
            path.mkdir()
        case 3:
            path.unlink()
            path.symlink_to(path.name)
        case 4:
            path.write_bytes(b"")
        case 5:
            twin.write_bytes(path.read_bytes())
