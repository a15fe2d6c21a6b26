"""Which words are effects, and which of them contradict one another."""

import numpy as np
import pytest

from datasets.errors import InputError
from datasets.vocabulary.effects import FURTHER_ONLY
from estimator.effects.choosing import catalogue, chosen_effects, contradiction, excluded, fittable, refuse_without_gravity
from estimator.effects.registry import MODELS


def test_effects_come_in_the_order_of_the_words() -> None:
    assert [e.entry.key for e in chosen_effects("magnus_lift, gravity,quadratic_drag")] == ["magnus_lift", "gravity", "quadratic_drag"]


@pytest.mark.parametrize(
    ("words", "parts"),
    [
        ("quadratic_drg", ('unknown effect "quadratic_drg"', "did you mean quadratic_drag")),
        ("gravity,lineardrag", ('unknown effect "lineardrag"', "linear_drag")),
        ("qqqq", ("tumble effect list",)),
        ("gravity,magnus_lift,gravity", ('"gravity" is there twice',)),
        (",", ("expected at least one effect",)),
        ("frame_rate,length_scale", ("contradict each other", "one number would have to give two")),
        ("frame_rate,quadratic_drag,gravity", ("frame_rate and gravity contradict each other", "how large gravity looks")),
        ("./nowhere.py:Wind", ("nowhere.py: expected the Python file of an effect, got nothing",)),
        ("./nowhere.py", ("expected FILE.py:CLASS",)),
        ("gravity@side", ("gravity without a camera", "got camera side")),
        ("focal_length@", ("the name of a camera behind @",)),
        ("focal_lenth@side", ('unknown effect "focal_lenth"', "did you mean focal_length")),
        ("focal_length@side,focal_length@side", ('"focal_length@side" is there twice',)),
    ],
)
def test_words_that_cannot_be_had(words: str, parts: tuple[str, ...]) -> None:
    with pytest.raises(InputError) as refused:
        chosen_effects(words)
    assert [part for part in parts if part not in str(refused.value)] == [], str(refused.value)


def test_every_effect_of_the_registry_can_be_fitted() -> None:
    assert set(fittable()) == set(MODELS)


def test_one_camera_has_no_effects_of_a_camera_alone() -> None:
    assert list(catalogue(("side",))) == list(catalogue()) == [key for key in MODELS if key not in FURTHER_ONLY]
    assert all(catalogue(("side",))[key] is MODELS[key] for key in catalogue())


def test_of_several_cameras_each_may_have_what_is_of_a_camera() -> None:
    """Lenses are each camera's own; what all may share is there for all alike, too; a clock is off against the first one's."""
    found = catalogue(("front", "side"))
    assert {"focal_length@front", "focal_length@side", "frame_rate", "frame_rate@front", "frame_rate@side", "clock_offset@side"} <= set(
        found
    )
    assert not {"focal_length", "clock_offset", "clock_offset@front", "gravity@side", "view_outline_offset@side"} & set(found)
    assert [found["focal_length@side"].camera, found["focal_length@side"].entry.scope] == ["side", MODELS["focal_length"].entry.scope]
    assert MODELS["focal_length"].camera is None


def test_words_may_name_a_camera() -> None:
    (effect,) = chosen_effects("principal_point@side")
    assert (effect.entry.key, effect.camera, effect.entry.title) == ("principal_point@side", "side", "principal point of camera side")
    assert excluded(["frame_rate@side", "length_scale"]) is None


def test_a_frame_rate_needs_gravity() -> None:
    none, some = np.zeros(3), np.array([0.0, 9.81, 0.0])
    with pytest.raises(InputError, match="frame_rate cannot be found in force-free flight"):
        refuse_without_gravity(["quadratic_drag", "frame_rate"], [none, none])
    refuse_without_gravity(["frame_rate"], [none, some])
    refuse_without_gravity(["quadratic_drag"], [none])


def test_what_is_refused_is_degenerate_indeed() -> None:
    """The columns of a frame rate and of gravity are combinations of one another and of the flight's own."""
    from estimator.appearance.model_errors import model_errors
    from estimator.effects.model import Model
    from estimator.motion.flight import COM
    from tests.estimator.small_campaign import registered

    campaign, start = registered().campaign, registered().start

    def left(words: str) -> float:
        """Share of the last column's length that the others cannot make."""
        model = Model(tuple(catalogue()[key] for key in words.split(",")))
        J = model_errors(campaign.sequences[0], start.flights[0], model, np.zeros(model.size)).J
        columns = J.reshape(-1, J.shape[-1])
        free = [*range(COM.start), *range(21, columns.shape[1])]
        A = columns[:, free] / np.maximum(np.linalg.norm(columns[:, free], axis=0), 1e-300)
        solution, *_ = np.linalg.lstsq(A[:, :-1], A[:, -1], rcond=1e-13)
        return float(np.linalg.norm(A[:, -1] - A[:, :-1] @ solution))

    assert left("gravity,frame_rate") < 0.02 * left("frame_rate")
    assert left("gravity,length_scale") < 0.02 * left("length_scale")
    assert left("length_scale,frame_rate") < 0.1 * left("frame_rate")


def test_values_of_every_sequence_can_stand_beside_what_all_share() -> None:
    """As ``explain`` finds them, and its next command names them: the scatter of one, the mean of the other."""
    words = "uniform_acceleration,frame_rate,centre_of_mass"
    assert [e.entry.key for e in chosen_effects(words)] == words.split(",")
    assert contradiction(["uniform_acceleration", "frame_rate"]) is not None


def test_a_wind_needs_something_to_act_by_and_comes_after_it() -> None:
    assert [e.entry.key for e in chosen_effects("steady_wind,linear_drag")] == ["linear_drag", "steady_wind"]
    assert contradiction(["steady_wind", "my_drag"]) is None
    assert "goes with lift alone" in str(contradiction(["induced_drag", "quadratic_drag"]))
    assert excluded(["induced_drag", "unmeasured_lift"]) is None
    with pytest.raises(InputError, match="steady_wind acts through drag or lift alone"):
        chosen_effects("steady_wind,gravity")
