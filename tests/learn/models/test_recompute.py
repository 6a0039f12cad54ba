import copy

import pytest
import torch
from torch.autograd.graph import saved_tensors_hooks

from ogmkit.errors import SettingsError
from ogmkit.learn.models.encoders import ImageEncoder
from ogmkit.learn.models.recompute import recompute_blocks


def step(net, image):
    """Bytes that are kept for the gradients."""
    kept = {}

    def keep(tensor):
        kept[tensor.untyped_storage().data_ptr()] = tensor.untyped_storage().nbytes()
        return tensor

    with saved_tensors_hooks(keep, lambda tensor: tensor):
        loss = net(image)[-1].square().mean()
    loss.backward()
    return sum(kept.values())


def test_nothing_changes_but_the_memory():
    torch.manual_seed(0)
    plain = ImageEncoder("resnet18")
    lean = copy.deepcopy(plain)
    recompute_blocks(lean)
    image = torch.rand(2, 3, 128, 160)
    much, little = step(plain, image), step(lean, image)
    assert little < 0.6 * much
    for ours, theirs in zip(lean.parameters(), plain.parameters(), strict=True):
        torch.testing.assert_close(ours.grad, theirs.grad)
    for name, value in plain.state_dict().items():
        torch.testing.assert_close(lean.state_dict()[name], value, msg=name)


def test_other_encoders_are_refused():
    with pytest.raises(SettingsError, match="resnet101"):
        recompute_blocks(ImageEncoder("vgg11_bn"))
