import json
from dataclasses import replace

import numpy as np
import pytest

from datasets.errors import InputError
from datasets.estimate import Status
from datasets.scoring.gate import compare, load_baseline, write_baseline
from datasets.scoring.metrics import METRICS
from datasets.scoring.score import score
from datasets.scoring.table import score_table

COUNT = 16
SIGMA = np.array([0.002, 0.002, 0.008, 0.3, 0.3, 0.3])


@pytest.fixture
def run(truth_of, estimate_of):
    """Rows of a run whose errors are ``base`` noise, scaled and shifted, plus fresh noise of a share."""

    def rows(*, scale=1.0, shift=0.0, fresh=0.0, sigma_scale=1.0, only=None, status=None):
        base, other = np.random.default_rng(11), np.random.default_rng(12)
        made = []
        for k in range(COUNT):
            truth = truth_of(f"seq_{k:04d}", seed=k)
            error = base.normal(size=6) * SIGMA
            noise = other.normal(size=6) * SIGMA
            touched = only is None or k in only
            changed = error * scale + shift * SIGMA + fresh * noise if touched else error
            estimate = estimate_of(truth, changed, sigma=0.01)
            covariance = np.diag((SIGMA * sigma_scale) ** 2)
            middle = replace(estimate.middle, covariance=covariance, bound=np.diag(SIGMA**2))
            estimate = replace(estimate, middle=middle, start=replace(estimate.start, covariance=covariance))
            if status is not None and touched:
                estimate = replace(estimate, status=status)
            made.append(score(estimate, truth))
        return made

    return rows


@pytest.fixture
def baseline(run, tmp_path):
    write_baseline(tmp_path / "baseline.json", score_table(run()), {"numpy": np.__version__})
    return load_baseline(tmp_path / "baseline.json")


def verdict(baseline, rows):
    return compare(baseline, rows, rng=np.random.default_rng(0))


def test_the_baseline_keeps_unit_direction_tolerance_and_environment(run, tmp_path):
    path = tmp_path / "baseline.json"
    write_baseline(path, score_table(run()), {"numpy": "2.4"})
    document = json.loads(path.read_text())
    assert document["environment"] == {"numpy": "2.4"}
    assert set(document["metrics"]) == {entry.key for entry in METRICS if entry.gated}
    entry = document["metrics"]["middle_angular_percent"]
    assert (entry["unit"], entry["direction"]) == ("%", "lower")
    median = np.median([row["middle_angular_percent"] for row in run()])
    assert entry["tolerance"] == pytest.approx(0.1 * median)


def test_the_baseline_may_name_its_recipe(run, tmp_path):
    write_baseline(tmp_path / "with.json", score_table(run()), {}, recipe="quick.toml")
    write_baseline(tmp_path / "without.json", score_table(run()), {})
    assert load_baseline(tmp_path / "with.json").recipe == "quick.toml"
    assert load_baseline(tmp_path / "without.json").recipe == ""


def test_an_identical_run_passes(baseline, run):
    result = verdict(baseline, run())
    assert not result.worse
    assert result.sentences == (f"Not worse than the baseline in {len(baseline.metrics)} metrics.",)
    assert all(comparison.median == comparison.low == comparison.high == 0 for comparison in result.comparisons)


@pytest.mark.parametrize(
    "change",
    [{"fresh": 0.001}, {"fresh": 0.1}, {"scale": 1.02}, {"scale": 0.5}, {"sigma_scale": 1.02}, {"shift": 0.01}],
    ids=str,
)
def test_harmless_changes_pass(baseline, run, change):
    result = verdict(baseline, run(**change))
    assert not result.worse, result.sentences


def test_another_realisation_of_the_same_noise_passes(baseline, run):
    result = verdict(baseline, run(scale=0.0, fresh=1.0))
    assert not result.worse, result.sentences


@pytest.mark.parametrize(
    ("change", "metrics"),
    [
        ({"scale": 1.5}, {"middle_in_plane_percent", "middle_out_of_plane_percent", "middle_angular_percent"}),
        ({"shift": 3.0}, {"middle_in_plane_percent", "middle_out_of_plane_percent", "middle_angular_percent"}),
        ({"fresh": 2.0}, {"middle_angular_percent"}),
        ({"sigma_scale": 0.5}, {"middle_mahalanobis2"}),
        ({"sigma_scale": 2.0}, {"middle_sigma_over_bound"}),
    ],
    ids=["scaled", "shifted", "noisier", "too sure", "too unsure"],
)
def test_planted_faults_are_caught_by_name(baseline, run, change, metrics):
    result = verdict(baseline, run(**change))
    assert result.worse
    assert metrics <= {comparison.key for comparison in result.comparisons if comparison.worse}
    assert len(result.sequences) > 0
    assert all(any(key in sentence for sentence in result.sentences) for key in metrics)


def test_one_sequence_that_jumps_is_named(baseline, run):
    result = verdict(baseline, run(scale=30.0, only={5}))
    assert result.worse
    assert result.sequences == ("seq_0005",)
    assert any("far worse in seq_0005" in sentence for sentence in result.sentences)


def test_a_number_that_the_baseline_lacks_hides_no_jump(baseline, run):
    rows = [{**row, "middle_angular_percent": float("nan")} if row["sequence"] == "seq_0001" else row for row in baseline.rows]
    result = verdict(replace(baseline, rows=tuple(rows)), run(scale=30.0, only={5}))
    (angular,) = (comparison for comparison in result.comparisons if comparison.key == "middle_angular_percent")
    assert angular.jumped == ("seq_0005",)
    nothing = [{**row, "middle_angular_percent": float("nan")} for row in baseline.rows]
    assert verdict(replace(baseline, rows=tuple(nothing)), run()).comparisons


def test_lost_convergence_is_named(baseline, run):
    result = verdict(baseline, run(status=Status.NO_CONVERGENCE, only={2, 3}))
    assert result.worse
    assert result.lost == ("seq_0002", "seq_0003")
    assert result.sentences[0] == "No longer converged: seq_0002, seq_0003."


def test_gained_convergence_is_no_fault(run, tmp_path):
    write_baseline(tmp_path / "b.json", score_table(run(status=Status.AMBIGUOUS, only={4})), {})
    result = verdict(load_baseline(tmp_path / "b.json"), run())
    assert not result.worse
    assert result.gained == ("seq_0004",)


def test_nothing_converged_any_more(baseline, run):
    result = verdict(baseline, run(status=Status.NO_CONVERGENCE))
    assert result.worse
    assert len(result.lost) == COUNT
    assert result.sentences[0].endswith("and 11 more.")


def test_missing_and_additional_sequences(baseline, run):
    with pytest.raises(InputError, match=r"came none for seq_0000, seq_0001\."):
        verdict(baseline, run()[2:])
    extra = {**run()[0], "sequence": "new"}
    assert "Left out, unknown to the baseline: new." in verdict(baseline, [*run(), extra]).sentences


def test_the_tolerance_of_the_file_counts(baseline, run):
    generous = {key: replace(entry, tolerance=1e9) for key, entry in baseline.metrics.items()}
    assert not verdict(replace(baseline, metrics=generous), run(scale=1.5)).worse


def test_the_direction_counts(baseline, run):
    upwards = {key: replace(entry, direction="higher") for key, entry in baseline.metrics.items()}
    assert not verdict(replace(baseline, metrics=upwards), run(scale=1.5)).worse
    assert verdict(replace(baseline, metrics=upwards), run(scale=0.2)).worse


def test_the_verdict_is_reproducible(baseline, run):
    assert verdict(baseline, run(fresh=0.5)) == verdict(baseline, run(fresh=0.5))


def test_bad_baselines(run, tmp_path):
    path = tmp_path / "b.json"
    with pytest.raises(InputError, match=r"b\.json: there is no such file"):
        load_baseline(path)
    write_baseline(path, score_table(run()), {})
    good = json.loads(path.read_text())
    good.pop("sha256")
    path.write_text(json.dumps({**good, "metrics": {"speed": good["metrics"]["position_median_mm"]}}))
    with pytest.raises(InputError, match="expected metrics of this version, came speed"):
        load_baseline(path)
    del good["rows"][1]["position_median_mm"]
    path.write_text(json.dumps(good))
    with pytest.raises(InputError, match='sequence "seq_0001": expected the metric position_median_mm'):
        load_baseline(path)
