"""What effects depend on is found out by trying."""

from estimator.effects.dependence import feels_air, idle, moves_air_alone, of_force
from estimator.effects.registry import MODELS


def test_drag_and_lift_feel_the_air_and_wind_alone_moves_it() -> None:
    feeling = {key for key, effect in MODELS.items() if feels_air(effect)}
    assert feeling == {"linear_drag", "quadratic_drag", "magnus_lift", "saturating_lift", "induced_drag"}
    assert [key for key, effect in MODELS.items() if moves_air_alone(effect)] == ["steady_wind"]
    assert of_force(MODELS["magnus_lift"]) == {"spin"}


def test_a_drag_by_lift_does_nothing_without_one_and_a_wind_nothing_that_is_not_felt() -> None:
    assert [key for key, effect in MODELS.items() if effect.of_lift] == ["induced_drag"]
    assert idle(MODELS["induced_drag"], [MODELS["quadratic_drag"], MODELS["gravity"]])
    assert not any(idle(MODELS["induced_drag"], [MODELS[key]]) for key in ("magnus_lift", "saturating_lift", "unmeasured_lift"))
    assert idle(MODELS["steady_wind"], [MODELS["unmeasured_lift"], MODELS["gravity"]])
    assert not idle(MODELS["steady_wind"], [MODELS["linear_drag"]])
    assert idle(MODELS["steady_wind"], [MODELS["induced_drag"]])
    assert not idle(MODELS["gravity"], [])


def test_a_wrong_reading_of_a_spin_does_nothing_where_nothing_acts_by_the_spin() -> None:
    misread = MODELS["unmeasured_lift"].as_noise(1.0)
    assert idle(misread, [MODELS["quadratic_drag"], MODELS["induced_drag"], misread])
    assert not idle(misread, [MODELS["magnus_lift"], misread])
    assert idle(MODELS["induced_drag"], [MODELS["quadratic_drag"], misread])
    assert not idle(MODELS["unmeasured_lift"], [])
