"""Fitting, held-out judgement, the ladder and the verdict on impacts whose law is known."""

import numpy as np
import pytest

from datasets.errors import InputError
from estimator.contact_validation.fitting import fit, log_volumes
from estimator.contact_validation.held_out import folds_of, judge
from estimator.contact_validation.ladder import _fitted_with, climb
from estimator.contact_validation.laws.force_models import Materials, hertz_mindlin_at_corner, hertz_mindlin_clump
from estimator.contact_validation.laws.models import ADDITIONS, RIGID, impulse_model
from estimator.contact_validation.laws.point_contact import STIFFEST, PointContact
from estimator.contact_validation.measured import experiment_of
from estimator.contact_validation.quantities import contact_of, inconsistent
from estimator.contact_validation.spread import carried, draws_of, prepared, residual_covariances, smooth_fields
from estimator.contact_validation.validate import Question, validate
from estimator.contact_validation.verdict import broken_verdict, contact_verdict
from tests.estimator.contact_validation.made_impacts import SIGMAS, made_impacts

pytestmark = pytest.mark.long

PLAIN = PointContact(0.6, 0.15)
IMPULSE_ALONE = Question(models=("stronge_impulse",))


def silent(_: str) -> None:
    """Nothing is told."""


def test_constants_come_back_within_their_uncertainty() -> None:
    impacts = prepared(made_impacts(PLAIN, 8, 5), 0)
    found = fit(impacts, RIGID)
    off = (found.values - [0.6, 0.15]) / found.sigmas
    assert np.abs(off).max() < 3.5
    assert found.sigmas.max() < 0.01


def test_errors_alone_leave_distances_of_six() -> None:
    impacts = prepared(made_impacts(PLAIN, 10, 6), 0)
    judged = judge(impacts, fit(impacts, RIGID))
    assert 2.0 < float(np.median(judged.distances2)) < 12.0
    assert judged.fitted.scatter < 0.011


def test_the_covariance_of_a_residual_is_that_of_its_draws() -> None:
    """With a state known exactly only the errors after the impact are left."""
    impact = made_impacts(PLAIN, 1, 7, corner_sigma_m=0.0)[0]
    covariance = np.diag(np.concatenate([np.zeros(12), SIGMAS[12:] ** 2]))
    exact = type(impact)(impact.run, impact.experiment, 0, impact.state, impact.after, covariance, impact.plate, impact.particle, 0.0)
    found = residual_covariances([exact], PLAIN, np.random.default_rng(0))[0]
    np.testing.assert_allclose(np.sqrt(np.diag(found)), SIGMAS[12:], rtol=0.25)


def test_errors_of_neighbouring_corners_are_alike() -> None:
    places = np.array([[0.0, 0.0, 0.0], [0.05, 0.0, 0.0], [6.0, 0.0, 0.0]])
    fields = smooth_fields(places, 4000, np.random.default_rng(1))[:, :, 0]
    correlation = np.corrcoef(fields.T)
    assert correlation[0, 1] > 0.98
    assert abs(correlation[0, 2]) < 0.35
    np.testing.assert_allclose(fields.std(axis=0), 1.0, atol=0.05)


def test_draws_come_in_pairs_of_opposite_sign() -> None:
    draws = draws_of(made_impacts(PLAIN, 1, 8)[0], np.random.default_rng(2), count=10)
    np.testing.assert_allclose(draws.errors.sum(axis=0), 0.0, atol=1e-12)


def test_runs_stay_together_in_folds() -> None:
    impacts = made_impacts(PLAIN, 6, 9)
    again = [type(i)(i.run, i.experiment, 1, i.state, i.after, i.covariance, i.plate, i.particle, i.corner_sigma_m) for i in impacts]
    ready = prepared([*impacts, *again], 0)
    for rows in folds_of(ready):
        inside = {ready.measured[k].run for k in rows}
        outside = {ready.measured[k].run for k in range(len(ready)) if k not in rows}
        assert not inside & outside


def test_a_contact_says_its_restitution_and_ratio() -> None:
    contact = contact_of(made_impacts(PLAIN, 1, 10, noise=0.0)[0], 0.15, np.random.default_rng(0))
    assert contact.restitution[0] == pytest.approx(0.6, abs=1e-3)
    assert contact.ratio[0] <= 0.15 + 1e-6
    assert contact.u_after[2] > 0.0 > contact.u_before[2]
    assert contact.one_contact_p > 0.99


def test_jumps_of_two_contacts_are_told() -> None:
    impact = made_impacts(PLAIN, 1, 11)[0]
    struck_twice = impact.after + np.array([0.0, 0.0, 0.0, 150.0, -90.0, 60.0])
    odd = type(impact)("odd", "odd", 0, impact.state, struck_twice, impact.covariance, impact.plate, impact.particle, impact.corner_sigma_m)
    contacts = [contact_of(i, 0.15, np.random.default_rng(0)) for i in (impact, odd)]
    assert inconsistent(contacts) == ("odd",)


def test_what_is_hidden_is_named_and_held_out_errors_fall() -> None:
    found = validate(made_impacts(PointContact(0.6, 0.15, compliance=1.1), 6, 13), IMPULSE_ALONE, silent)
    assert found.verdict.missing[0] == "tangential_compliance"
    rung = found.ladder.accepted[2]
    assert rung.judged.cost < found.ladder.rungs[1].judged.cost - 12.0
    assert found.ranking[0].model.key.endswith("tangential_compliance")


def test_a_restitution_that_falls_with_speed_is_accepted_first() -> None:
    ladder = climb(prepared(made_impacts(PointContact(0.6, 0.15, slowing=0.25), 6, 13), 0), 0, silent)
    assert ladder.missing[0] == "velocity_dependent_restitution"
    assert ladder.accepted[2].judged.cost < ladder.rungs[1].judged.cost - 12.0


def test_hertz_mindlin_is_behind_where_the_rigid_impulse_is_true() -> None:
    impacts = prepared(made_impacts(PLAIN, 5, 14), 0)
    rigid, springs = fit(impacts, RIGID), fit(impacts, hertz_mindlin_at_corner(Materials()))
    assert rigid.cost < springs.cost
    assert springs.values[1] == pytest.approx(0.15, abs=0.03)


def test_a_friction_that_one_late_slip_tells_is_found() -> None:
    """Seven contacts stick, one slips: the minimum is narrow, and far from where searches start."""
    found = fit(prepared(made_impacts(PointContact(0.25, 0.8), 8, 11), 0), RIGID)
    assert found.values[1] == pytest.approx(0.8, abs=0.01)


def test_what_errs_is_within_its_standard_deviations() -> None:
    """Friction of 24 sets with errors as stated: twice the standard deviations would leave 0.5, those of least squares halved 1.4."""
    off = []
    for seed in range(24):
        found = fit(prepared(made_impacts(PLAIN, 8, 200 + seed), 0), RIGID)
        off.append((found.values[1] - 0.15) / found.sigmas[1])
    assert 0.7 < float(np.sqrt(np.mean(np.square(off)))) < 1.3


@pytest.mark.parametrize("key", [physics.key for physics in ADDITIONS])
def test_an_addition_never_fits_worse_than_nothing_of_it(key: str) -> None:
    impacts = prepared(made_impacts(PLAIN, 4, 17), 0)
    before = fit(impacts, RIGID)
    assert _fitted_with(impacts, before, [key]).cost < before.cost + 0.05


def test_little_compliance_does_little_and_no_compliance_nothing() -> None:
    impacts = made_impacts(PLAIN, 6, 18)
    rigid, little, stiffest = (PointContact(0.6, 0.15, compliance=c).after(impacts) for c in (0.0, 0.5 * STIFFEST, STIFFEST))
    assert 0.0 < np.abs(stiffest - rigid).max()
    np.testing.assert_allclose(little - rigid, 0.5 * (stiffest - rigid), atol=1e-12)


def test_physics_that_was_accepted_is_told_where_there_is_no_friction() -> None:
    ladder = climb(prepared(made_impacts(PointContact(0.6, 0.0, slowing=0.25), 8, 19), 0), 0, silent)
    assert contact_verdict(ladder, "", (), ()).missing == ladder.missing
    assert ladder.missing == ("velocity_dependent_restitution",)


def test_a_constant_at_the_end_of_its_search_is_told() -> None:
    ladder = climb(prepared(made_impacts(PointContact(1.0, 0.15), 5, 20), 0), 0, silent)
    verdict = contact_verdict(ladder, "", (), ())
    assert any("restitution = 1" in remark and "search ends" in remark for remark in verdict.remarks)


def test_a_clump_predicts_as_many_impacts_as_there_are() -> None:
    impacts = made_impacts(PLAIN, 2, 15)
    model = hertz_mindlin_clump(Materials(), impacts, 12)
    after = model.predict(impacts, np.array([0.6, 0.15]))
    assert after.shape == (2, 6)
    rebound = [row[:3] @ i.plate.normal_world for row, i in zip(after, impacts, strict=True)]
    assert min(rebound) > min(i.state.v_world @ i.plate.normal_world for i in impacts)


def test_bad_questions_are_refused() -> None:
    with pytest.raises(InputError, match="at least 4 runs, got 2"):
        validate(made_impacts(PLAIN, 2, 16), Question(), silent)
    with pytest.raises(InputError, match=r"contact models: .* got glue"):
        Question(models=("glue",))
    with pytest.raises(InputError, match="Poisson's ratio of the particle"):
        Materials(poisson_particle=0.6)
    with pytest.raises(InputError, match="Young's modulus of the plate"):
        Materials(young_plate_pa=-1.0)


def test_a_particle_that_broke_in_most_runs_is_the_verdict() -> None:
    verdict = broken_verdict(["a", "b", "c"], 4)
    assert verdict is not None
    assert verdict.missing == ("chip",)
    assert "3 of 4 runs" in verdict.sentence
    assert broken_verdict(["a"], 4) is None


def test_experiments_are_read_from_names() -> None:
    assert experiment_of("stone-e03-r07") == "stone-e03"
    assert experiment_of("toss") == "toss"
    assert experiment_of("left-right") == "left-right"


def test_what_a_compliant_contact_makes_of_errors_counts_once_it_is_accepted() -> None:
    law = PointContact(0.6, 0.2, compliance=1.1)
    rigid = prepared(made_impacts(law, 8, 41), 0)
    found = fit(rigid, impulse_model(["tangential_compliance"]))
    impacts, fitted = carried(rigid, found, 0)
    assert fitted.by_name["compliance"] == pytest.approx(1.1, abs=0.1)
    volume = log_volumes(impacts) - log_volumes(rigid)
    assert np.abs(volume).max() > 0.6
    covariance = np.linalg.inv(impacts.whitening[0].T @ impacts.whitening[0])
    assert log_volumes(impacts)[0] == pytest.approx(np.log(np.linalg.eigvalsh(covariance)).sum(), rel=1e-6)
    again, _ = carried(impacts, fitted, 0)
    np.testing.assert_allclose(again.whitening, impacts.whitening, rtol=0.05)


def test_a_tilt_that_is_in_the_model_is_no_uncertainty() -> None:
    impacts = prepared(made_impacts(PointContact(0.6, 0.15, tilt=0.05, tilt_across=-0.05), 8, 42), 0)
    tilted, fitted = carried(impacts, fit(impacts, impulse_model(["plate_tilt"])), 0)
    assert fitted.by_name["tilt"] == pytest.approx(0.05, abs=5e-3)
    assert np.abs(np.linalg.slogdet(tilted.whitening)[1] - np.linalg.slogdet(impacts.whitening)[1]).max() < 1.5
