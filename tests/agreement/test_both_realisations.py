"""What nature does by an effect and what the instrument's reduced model of it undoes are the same, in sign, unit and convention.

Nature makes exact outlines with the effect; the whole forward chain of the estimator, from time stamps to tangency errors, is evaluated at
the true flight. Without the effect in the model the errors are as large as the effect; with it, what is left is what the reduced model
leaves out. Each parameter with its sign turned must leave most of what this parameter does, or the agreement would mean nothing.
"""

from dataclasses import replace

import numpy as np
import pytest

from datasets.vocabulary.effects import EFFECTS, FURTHER_ONLY, PICTURED, Stage
from estimator.effects.registry import MODELS
from estimator.likelihood.time_shifts import TimeShifts, jitter_test, time_derivative
from synth.effects import REALISATIONS
from tests.agreement.exact_sequences import RECIPE, Values, errors_at, made, rms
from tests.agreement.sizes import SIZES

pytestmark = pytest.mark.long

EXACT = 1e-3
LEFT_OUT = {
    # Speeds are those of the nearest of 240 rim points, found by normals that leave perspective out; nature's grid has cells of 1/16 px:
    # 2.4% seen.
    "motion_blur_threshold": 0.04,
    # Points of the rim are tabled over directions one to three degrees apart: 0.3% seen.
    "rolling_shutter": 0.006,
    # The recession is evaluated at the displaced point and its slope across the picture turns tangents: 0.4% seen.
    "blooming": 0.01,
    # Flatness is tabulated for 72 directions and is that of the hull's outline before the displacement: 2.7% seen.
    "rim_light_leak": 0.04,
    # Nature's picture has cells of 1/8 px, and curvature is a mean over 20 degrees: 9.7% seen (0.01 px), 2.8% in the median.
    "defocus_growth": 0.15,
}
"""Share of an effect's size that the reduced model may leave, where it is not exact."""
STATED_DISTORTION = 0.01
"""The reduced models undo an effect before the stated distortion, nature adds the coefficients: they differ by the product of the two."""
TURNED = 0.5
OF_ITS_OWN = ("trigger_jitter",)
"""A random effect has no value to put into the chain; it is compared frame by frame below."""
IN_CHAIN = [key for key in PICTURED if key not in OF_ITS_OWN]
PARAMETERS = [(key, name) for key in IN_CHAIN for name in EFFECTS[key].names]


def turned(key: str, name: str, values: Values) -> dict[str, float]:
    """The other sign; a gap elsewhere; blur, which enters squared, twice as large."""
    wrong = {"after_frame": 1.0, "blur": 2.0 * values[name]}
    return {**values, name: wrong.get(name, -values[name])}


def without(key: str, name: str, values: Values) -> dict[str, float]:
    """Without what one parameter does; without the effect where the parameter has no size of its own."""
    entry = EFFECTS[key]
    if name not in entry.sizes:
        return dict.fromkeys(values, 0.0)
    return {**values, name: 0.0}


def test_every_effect_has_both_realisations_and_a_size() -> None:
    assert set(EFFECTS) == set(MODELS)
    assert set(PICTURED) | set(FURTHER_ONLY) == set(SIZES)
    assert set(EFFECTS) <= set(REALISATIONS)
    for key, values in SIZES.items():
        assert set(values) == set(EFFECTS[key].names)
        for p in EFFECTS[key].parameters:
            assert p.plausible[0] <= values[p.name] <= p.plausible[1]


@pytest.mark.parametrize("key", IN_CHAIN)
@pytest.mark.parametrize("share", [0.0, 0.5], ids=["from_first_frame", "from_middle"])
def test_the_model_undoes_what_nature_does(key: str, share: float) -> None:
    values, sequence = SIZES[key], made(key, SIZES[key])
    size = rms(errors_at(sequence, key, dict.fromkeys(values, 0.0)))
    left = rms(errors_at(sequence, key, values, time_s=share * float(sequence.plan.clock.times_s[-1])))
    assert size > 0.03
    assert left <= LEFT_OUT.get(key, EXACT) * size


@pytest.mark.parametrize(("key", "name"), PARAMETERS)
def test_another_sign_is_seen(key: str, name: str) -> None:
    """What is wrong with one parameter turned is more than half of what this parameter does in nature."""
    values, sequence = SIZES[key], made(key, SIZES[key])
    there = errors_at(sequence, key, values)
    other = errors_at(made(key, without(key, name, values)), key, values)
    does = float(np.sqrt(np.mean((other.e - there.e)[there.seen & other.seen] ** 2)))
    assert does > 0.0
    assert rms(errors_at(sequence, key, turned(key, name, values))) > TURNED * does


@pytest.mark.parametrize("key", [key for key in IN_CHAIN if EFFECTS[key].stage is Stage.OPTICS and key != "defocus_growth"])
def test_optics_on_top_of_a_stated_distortion(key: str) -> None:
    bent = replace(RECIPE.hsv, distortion=(0.5, -20.0, 2e-3, -1e-3, 0.0), principal_point_offset_px=(30.0, -20.0))
    sequence = made(key, SIZES[key], replace(RECIPE, hsv=bent))
    size = rms(errors_at(sequence, key, dict.fromkeys(SIZES[key], 0.0)))
    assert rms(errors_at(sequence, key, SIZES[key])) <= STATED_DISTORTION * size


@pytest.mark.parametrize("key", IN_CHAIN)
def test_nature_without_size_is_undisturbed(key: str) -> None:
    """A hundredth of each size does at most three hundredths as much; pictures on a grid of 1/8 px are exact to 8e-3 px."""
    values = {name: v if name not in EFFECTS[key].sizes else 0.01 * v for name, v in SIZES[key].items()}
    nothing = dict.fromkeys(values, 0.0)
    grid = 8e-3 if key in ("motion_blur_threshold", "defocus_growth") else 0.0
    size = rms(errors_at(made(key, SIZES[key]), key, nothing))
    assert rms(errors_at(made(key, values), key, nothing)) <= 0.03 * size + grid


def test_jitter_is_the_shift_of_each_frame() -> None:
    """One-step shifts of the sightings are nature's shifts of the frames' times, to second order, and their deviation is found."""
    sequence = made("trigger_jitter", SIZES["trigger_jitter"])
    errors = errors_at(sequence, "trigger_jitter", {"sigma": 0.0})
    d = time_derivative(errors)
    tau = -np.einsum("nks,nks->n", d, errors.e) / np.einsum("nks,nks->n", d, d)
    true = sequence.plan.true_times_s - sequence.plan.clock.times_s
    assert np.abs(true).max() > 1e-5
    np.testing.assert_allclose(tau, true, atol=5e-3 * np.abs(true).max())
    assert np.abs(-tau - true).max() > TURNED * np.abs(true).max()


def test_jitter_of_nature_is_recovered() -> None:
    sigma, count = SIZES["trigger_jitter"]["sigma"], 400
    stamps = np.arange(count) / 4000.0
    tau = REALISATIONS["trigger_jitter"].true_times(stamps, {"sigma": sigma}, np.random.default_rng(3)) - stamps
    information = np.full(count, (0.1 * sigma) ** -2)
    found = jitter_test([TimeShifts(tau, information, 1.0 / information)])
    assert found.sigma_s == pytest.approx(sigma, abs=3.0 * found.sigma_error_s)
    assert found.sigma_error_s < 0.05 * sigma
    assert found.p < 1e-6
