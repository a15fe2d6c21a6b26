"""The gate's decisions, on made-up rows: what is worse, better or the same, what is lost, and how often chance alone raises an alarm."""

import json
from dataclasses import replace

import numpy as np
import pytest

from datasets.errors import InputError
from datasets.estimate import Status
from datasets.scoring.gate import FALSE_ALARMS, JUMP, LOST_SHARE, TOLERATED, Baseline, compare, load_baseline, write_baseline
from datasets.scoring.gate_measures import MEASURES, gate_row

SIZES = {"flights": 8, "pictures": 8, "impacts": 8, "campaigns": 12}


def rows(rng, *, kinds=tuple(SIZES), scale=1.0, spread=None):
    """Independent errors of sequences that are differently hard: norms of one to three normal components."""
    hard = {kind: np.exp(np.random.default_rng(7).normal(size=SIZES[kind])) for kind in kinds}
    return {
        kind: [row(rng, kind, k, scale * hard[kind][k] * (1.0 if spread is None else spread)) for k in range(SIZES[kind])] for kind in kinds
    }


def row(rng, kind, k, size):
    values = {
        measure.key: float(np.linalg.norm(rng.standard_normal(1 + n % 3)) * (1.0 if measure.nats else size))
        for n, measure in enumerate(MEASURES[kind])
    }
    return {"sequence": f"{kind}-{k}", "status": "converged", "measured": True, **values}


def baseline_of(found):
    return Baseline(found, {}, "quick.toml", {})


def changed(found, kind, key, factor, *, of=None):
    """The rows with one measure of one kind multiplied, of all sequences or of the first ``of``."""
    made = [{**each, key: each[key] * factor} if of is None or k < of else each for k, each in enumerate(found[kind])]
    return {**found, kind: made}


@pytest.fixture
def old():
    return rows(np.random.default_rng(1))


def test_the_same_run_is_the_same_to_the_digit(old):
    result = compare(baseline_of(old), old)
    assert not result.worse
    assert all(each.ratio == each.low == each.high == 1.0 for each in result.comparisons)
    assert [result.verdict(kind) for kind in SIZES] == ["same"] * 4


@pytest.mark.parametrize("kind", SIZES)
def test_what_is_worse_is_told_by_kind_and_measure_with_its_sequences(old, kind):
    key = MEASURES[kind][1].key
    result = compare(baseline_of(old), changed(old, kind, key, 2.0))
    worse = [each for each in result.comparisons if each.verdict == "worse"]
    assert [(each.kind, each.measure.key) for each in worse] == [(kind, key)]
    assert 1.5 < worse[0].ratio < 2.0
    assert worse[0].low > TOLERATED
    assert [result.verdict(other) for other in SIZES if other != kind] == ["same"] * 3
    assert set(result.sequences(kind)) <= {each["sequence"] for each in old[kind]}
    assert result.sequences(kind)


def test_what_is_better_is_no_alarm(old):
    result = compare(baseline_of(old), changed(old, "flights", "middle_angular_percent", 0.5))
    assert not result.worse
    assert result.verdict("flights") == "better"


def test_what_is_tolerated_is_no_alarm(old):
    assert not compare(baseline_of(old), changed(old, "flights", "middle_angular_percent", 1.05)).worse


def test_one_sequence_decides_nothing_alone_but_is_told(old):
    result = compare(baseline_of(old), changed(old, "flights", "middle_angular_percent", 1e6, of=1))
    assert not result.worse
    (told,) = (each for each in result.comparisons if each.kind == "flights" and each.measure.key == "middle_angular_percent")
    assert told.sequences == (("flights-0", pytest.approx(JUMP)),)


def test_more_sequences_lost_than_noise_loses_are_an_alarm(old):
    def without(count):
        lost = [{**each, "measured": k >= count} for k, each in enumerate(old["flights"])]
        return compare(baseline_of(old), {**old, "flights": lost})

    assert LOST_SHARE * SIZES["flights"] < 1
    assert not without(1).worse
    assert without(4).worse
    assert without(4).sequences("flights") == ("flights-0", "flights-1", "flights-2", "flights-3")


def lost(found, kind, names):
    return {**found, kind: [{**each, "measured": each["measured"] and each["sequence"] not in names} for each in found[kind]]}


def test_a_few_lost_of_every_kind_are_an_alarm_together(old):
    new = old
    for kind in SIZES:
        new = lost(new, kind, {f"{kind}-0", f"{kind}-1"})
    result = compare(baseline_of(old), new)
    assert not any(losses.worse for losses in result.losses)
    assert (result.together.n, len(result.together.lost), result.together.worse) == (sum(SIZES.values()), 8, True)
    assert result.worse
    assert [result.verdict(kind) for kind in SIZES] == ["worse"] * 4
    assert not compare(baseline_of(old), lost(old, "flights", {"flights-0", "flights-1"})).worse


def test_false_names_of_controls_are_a_decision_of_their_own(old):
    plans = {each["sequence"]: {"hidden": {} if k < 3 else {"quadratic_drag": {}}} for k, each in enumerate(old["campaigns"])}
    baseline = replace(baseline_of(old), made_from={"campaigns": plans})
    two = lost(old, "campaigns", {"campaigns-0", "campaigns-1"})
    assert not compare(baseline_of(old), two).worse
    result = compare(baseline, two)
    assert (result.controls.n, len(result.controls.lost), result.controls.worse) == (3, 2, True)
    assert (result.worse, result.verdict("campaigns"), result.verdict("flights")) == (True, "worse", "same")
    assert not compare(baseline, lost(old, "campaigns", {"campaigns-0", "campaigns-5"})).worse


def test_every_decision_is_counted(old):
    plans = {each["sequence"]: {"hidden": {}} for each in old["campaigns"]}
    measures = sum(len(MEASURES[kind]) for kind in SIZES)
    assert compare(baseline_of(old), old).decisions == measures + len(SIZES) + 1
    assert compare(replace(baseline_of(old), made_from={"campaigns": plans}), old).decisions == measures + len(SIZES) + 2
    assert compare(baseline_of({"flights": old["flights"]}), old).decisions == len(MEASURES["flights"]) + 1


def test_what_is_newly_measured_is_told(old):
    before = {**old, "flights": [{**each, "measured": k > 0} for k, each in enumerate(old["flights"])]}
    (losses,) = (each for each in compare(baseline_of(before), old).losses if each.kind == "flights")
    assert (losses.gained, losses.lost, losses.worse) == (("flights-0",), {}, False)


def test_a_number_that_is_lost_is_infinitely_worse(old):
    result = compare(baseline_of(old), changed(old, "flights", "middle_angular_percent", np.nan))
    (worse,) = (each for each in result.comparisons if each.verdict == "worse")
    assert worse.ratio == pytest.approx(JUMP)


def test_where_most_errors_were_zero_what_is_as_good_as_none_is_no_alarm(old):
    none = changed(old, "flights", "middle_angular_percent", 0.0)
    key = "middle_angular_percent"
    tiny, large = ({**none, "flights": [{**each, key: error} for each in none["flights"]]} for error in (1e-6, 1.0))
    assert not compare(baseline_of(none), tiny).worse
    assert compare(baseline_of(none), large).worse


def test_what_may_be_worse_unseen_is_the_largest_upper_end(old):
    result = compare(baseline_of(old), rows(np.random.default_rng(2)))
    assert result.widest.high == max(each.high for each in result.comparisons)


def test_kinds_of_few_sequences_are_told(old):
    short = {**old, "flights": old["flights"][:5]}
    assert compare(baseline_of(short), short).few == ("flights",)
    assert compare(baseline_of(old), old).few == ()


def test_what_neither_has_is_left_out(old):
    lacking = changed(old, "campaigns", "velocity_ms", np.nan, of=5)
    (told,) = (each for each in compare(baseline_of(lacking), lacking).comparisons if each.measure.key == "velocity_ms")
    assert told.n == SIZES["campaigns"] - 5


def test_what_failed_makes_a_run_worse(old):
    assert compare(baseline_of(old), old, {"flights/flights-0": "ZeroDivisionError"}).worse


def test_fresh_noise_raises_no_more_alarms_than_stated():
    rng = np.random.default_rng(3)
    trials = 300
    alarms = sum(compare(baseline_of(rows(rng)), rows(rng)).worse for _ in range(trials))
    assert alarms <= trials * FALSE_ALARMS + 3 * np.sqrt(trials * FALSE_ALARMS)


def test_sequences_must_be_the_same(old):
    with pytest.raises(InputError, match=r"flights: expected every sequence of the baseline, got none for flights-0\."):
        compare(baseline_of(old), {**old, "flights": old["flights"][1:]})
    other = {**old["flights"][0], "sequence": "new"}
    with pytest.raises(InputError, match="expected the sequences of the baseline, got new besides"):
        compare(baseline_of(old), {**old, "flights": [*old["flights"], other]})


def test_a_baseline_is_read_as_it_was_written(old, tmp_path):
    kept = Baseline(old, {"numpy": "2.4"}, "quick.toml", {"recipes": {}}, {"flights": 3.5})
    write_baseline(tmp_path / "b.json", kept)
    found = load_baseline(tmp_path / "b.json")
    assert {kind: list(each) for kind, each in found.rows.items()} == old
    assert (found.environment, found.set_file, found.made_from, found.cpu_s) == (
        {"numpy": "2.4"},
        "quick.toml",
        {"recipes": {}},
        {"flights": 3.5},
    )


def test_baselines_of_another_schema_are_refused(old, tmp_path):
    path = tmp_path / "b.json"
    with pytest.raises(InputError, match=r"b\.json: there is no such file"):
        load_baseline(path)
    write_baseline(path, baseline_of(old))
    good = json.loads(path.read_text())
    good.pop("sha256")
    earlier = {"format": "tumble baseline", "schema_version": 1, "environment": {}, "metrics": {}, "rows": []}
    spoiled = {
        r"got one of an earlier Tumble, of flights alone": earlier,
        r"expected schema version 1 or older, got 2; a newer Tumble wrote it": {**good, "schema_version": 2},
        r"expected flights, pictures, impacts, campaigns, got swims": {**good, "kinds": {"swims": []}},
        r'sequence "flights-1": expected the measures of this version, got none for position_in_plane_mm': without_one(good),
    }
    for said, document in spoiled.items():
        path.write_text(json.dumps(document))
        with pytest.raises(InputError, match=said):
            load_baseline(path)


def without_one(document):
    copy = json.loads(json.dumps(document))
    del copy["kinds"]["flights"][1]["position_in_plane_mm"]
    return copy


def test_a_row_of_another_sequence_is_refused(truth_of, estimate_of):
    truth, other = truth_of("one", seed=1), truth_of("two", seed=2)
    with pytest.raises(InputError, match='expected the estimate of sequence "one", got that of "two"'):
        gate_row("flights", estimate_of(other, np.zeros(6)), truth)


def test_an_estimate_without_numbers_is_not_measured(truth_of, estimate_of):
    truth = truth_of("one", seed=1)
    good = gate_row("flights", estimate_of(truth, np.full(6, 0.01), sigma=0.01), truth)
    assert good["measured"]
    lost = replace(estimate_of(truth, np.full(6, 0.01), sigma=0.01), status=Status.NO_CONVERGENCE)
    found = gate_row("flights", lost, truth)
    assert not found["measured"]
    assert np.isnan(found["middle_angular_percent"])
