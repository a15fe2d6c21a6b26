"""What is reported of fitted values: whole numbers, and how accurate a reduced model is."""

import numpy as np

from estimator.effects.registry import MODELS


def test_a_count_is_reported_as_the_whole_number_it_is_near() -> None:
    gap = MODELS["dropped_frames"]
    value, sigma = gap.reported(np.array([1.94, 31.0]), np.array([0.02**2, 0.0]))
    assert value.tolist() == [2.0, 31.0]
    np.testing.assert_allclose(sigma, [0.02, 0.0])


def test_what_is_no_whole_number_is_reported_as_it_is() -> None:
    value, _ = MODELS["dropped_frames"].reported(np.array([1.6, 31.0]), np.zeros(2))
    assert value[0] == 1.6


def test_a_models_accuracy_adds_to_the_noise() -> None:
    for key in ("rim_light_leak", "defocus_growth"):
        value, sigma = MODELS[key].reported(np.array([2.0]), np.array([0.1**2]))
        assert value[0] == 2.0
        assert MODELS[key].accuracy > 0.0
        np.testing.assert_allclose(sigma, np.hypot(0.1, MODELS[key].accuracy * 2.0))


def test_what_is_searched_beside_a_size_has_no_accuracy_of_its_own() -> None:
    class Rough(type(MODELS["camera_vibration"])):  # type: ignore[misc]
        accuracy = 0.1

    _, sigma = Rough().reported(np.array([1.0, 0.0, 0.0, 0.0, 200.0]), np.zeros(5))
    np.testing.assert_allclose(sigma, [0.1, 0.0, 0.0, 0.0, 0.0])


def test_an_exact_model_reports_its_noise() -> None:
    _, sigma = MODELS["frame_rate"].reported(np.array([0.1]), np.array([4e-6]))
    np.testing.assert_allclose(sigma, 2e-3)


def test_corners_that_a_hull_does_not_show_widen_what_is_reported_on_bodies_with_hollows() -> None:
    model, value, variance = MODELS["blooming"], np.array([2.0]), np.array([0.1**2])
    assert model.accuracy_on(0.0) == model.accuracy
    whole, half, hollow, most = (model.reported(value, variance, share)[1][0] for share in (0.0, 0.025, 0.05, 0.2))
    assert whole < half < hollow == most
    np.testing.assert_allclose(hollow, np.hypot(0.1, 2.0 * np.hypot(model.accuracy, model.accuracy_at_spikes)))
