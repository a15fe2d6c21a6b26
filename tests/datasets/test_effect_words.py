"""Keys of effects of one camera alone, and how they are said."""

import pytest

from datasets.vocabulary.effects import EFFECTS, begins, in_words, of_camera, whose


@pytest.mark.parametrize("key", EFFECTS)
def test_a_key_tells_effect_and_camera(key: str) -> None:
    assert whose(of_camera(key, "hsv_2")) == (key, "hsv_2")
    assert whose(key) == (key, "")


def test_a_key_is_said_with_its_camera() -> None:
    """A camera's name is said as it is written."""
    assert in_words("focal_length@Left_2") == "focal length of camera Left_2"
    assert begins(in_words("focal_length@Left_2")) == "Focal length of camera Left_2"
    assert in_words("focal_length") == EFFECTS["focal_length"].title == "focal length"
