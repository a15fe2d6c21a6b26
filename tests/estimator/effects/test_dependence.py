"""What effects depend on is found out by trying."""

from estimator.effects.dependence import feels_air, moves_air_alone, of_force
from estimator.effects.registry import MODELS


def test_drag_and_lift_feel_the_air_and_wind_alone_moves_it() -> None:
    feeling = {key for key, effect in MODELS.items() if feels_air(effect)}
    assert feeling == {"linear_drag", "quadratic_drag", "magnus_lift", "saturating_lift", "spin_drag"}
    assert [key for key, effect in MODELS.items() if moves_air_alone(effect)] == ["steady_wind"]
    assert of_force(MODELS["magnus_lift"]) == {"spin"}
