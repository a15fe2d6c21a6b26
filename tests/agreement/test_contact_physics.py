"""The reduced laws of the ladder against nature's contact, at states and hulls that are known exactly."""

from functools import cache, partial

import numpy as np
import pytest

from datasets.recipes.recipe import EffectRecipe
from estimator.contact_validation.fitting import Fitted, Impacts, fit
from estimator.contact_validation.laws.models import RIGID, impulse_model
from estimator.contact_validation.spread import prepared
from synth.contact.law import contact_law
from synth.sequence import plan_sequence
from tests.reference import contact_sets
from tests.reference.contact_sets import drop_recipe, measured_set

pytestmark = pytest.mark.long

RUNS, SEED = 10, 31
EXACT = ("CORNER_ERROR_SHARE", "INERTIA_ERROR", "CENTRE_ERROR_SHARE")
MOST_OFF = 3e-3
"""Of the jump of velocity, in the median; linear springs in place of Hertz's are further off."""
HIDDEN = {
    "tangential_compliance": EffectRecipe("tangential_compliance", {"ratio": 1.0}),
    "velocity_dependent_restitution": EffectRecipe("velocity_dependent_restitution", {"yield_speed": 0.3}),
    "adhesion": EffectRecipe("adhesion", {"pull_off": 0.6, "reach": 1e-5}),
    "plate_tilt": EffectRecipe("plate_tilt", {"angle": 0.04, "angle_across": -0.03}),
    "yielding_plate": EffectRecipe("yielding_plate", {"inverse_mass": 1500.0}),
}


@cache
def exact_impacts(key: str) -> Impacts:
    """Impacts with nothing wrong in them, in units of what an instrument would be uncertain of."""
    recipe = drop_recipe(SEED, (HIDDEN[key],) if key else ())
    planned = cache(partial(plan_sequence, recipe))
    with pytest.MonkeyPatch.context() as patch:
        # Nature is the same in both sets: each drop is flown once.
        patch.setattr(contact_sets, "plan_sequence", lambda _, index: planned(index))
        uncertain = prepared(measured_set(recipe, RUNS, np.random.default_rng(0)), 0)
        patch.setattr(contact_sets, "SIGMAS", 1e-6 * contact_sets.SIGMAS)
        for name in EXACT:
            patch.setattr(contact_sets, name, 0.0)
        known = measured_set(recipe, RUNS, np.random.default_rng(0))
    return Impacts(tuple(known), uncertain.whitening, uncertain.scattering)


@cache
def law(key: str) -> Fitted:
    """The ladder's own law for what is hidden."""
    return fit(exact_impacts(key), impulse_model([key] if key else []))


def off(key: str, fitted: Fitted) -> float:
    """Median difference of velocity over its jump."""
    measured = exact_impacts(key).measured
    left = (exact_impacts(key).after - fitted.model.predict(measured, fitted.values))[:, :3]
    jump = exact_impacts(key).after[:, :3] - np.stack([impact.state.v_world for impact in measured])
    return float(np.median(np.linalg.norm(left, axis=1) / np.linalg.norm(jump, axis=1)))


@pytest.mark.parametrize("key", ["", *HIDDEN])
def test_the_reduced_law_does_what_nature_does(key: str) -> None:
    assert off(key, law(key)) < MOST_OFF


@pytest.mark.parametrize("key", HIDDEN)
def test_the_rigid_impulse_does_not(key: str) -> None:
    assert off(key, fit(exact_impacts(key), RIGID)) > 1.5 * off(key, law(key))


def test_the_compliance_found_is_that_of_the_springs() -> None:
    recipe = drop_recipe(SEED, (HIDDEN["tangential_compliance"],))
    assert recipe.plate is not None
    springs = contact_law(recipe.contact, recipe.plate, {"tangential_compliance": {"ratio": 1.0}})
    assert law("tangential_compliance").by_name["compliance"] == pytest.approx(
        1.5 * springs.stiffness / springs.tangential_stiffness, rel=0.02
    )


def test_the_slowing_found_is_that_of_plastic_flow() -> None:
    assert law("velocity_dependent_restitution").by_name["slowing"] == pytest.approx(0.25, abs=0.06)
