"""Numbers in words, intervals that hold as often as they say, medians beside what error bars predict, and laws with known exponents."""

import numpy as np
import pandas as pd
import pytest

from datasets.scoring.metrics import COMPONENTS
from studies.reporting.laws import power_law
from studies.reporting.medians import QUANTITIES, held_in_words, lost_in_words, median_interval, medians
from studies.reporting.words import number, paragraph, percent, share, table, with_interval

SIGMA = {"vx": 3e-4, "vy": 3e-4, "vz": 2e-3, "wx": 0.05, "wy": 0.05, "wz": 0.05}


@pytest.mark.parametrize(
    ("value", "text"), [(0.05923, "0.0592"), (12.0, "12"), (1234.5, "1234"), (0.0, "0"), (0.25, "0.25"), (100, "100"), (np.nan, "–")]
)
def test_three_digits_without_exponent(value: float, text: str) -> None:
    assert number(value) == text


def test_shares_carry_their_count_and_exact_interval() -> None:
    assert share(np.array([True] * 119 + [False])) == "99.2% (95.4 to 100.0%; 119 of 120)"
    assert share(np.zeros(0)) == "–"
    assert percent(np.nan) == "–"
    assert percent(0.5) == "0.5%"


def test_tables_and_paragraphs() -> None:
    assert table(("a", "b"), [["x", 1]]) == ["| a | b |", "| --- | --- |", "| x | 1 |"]
    assert paragraph("word " * 60, "end.")[-1].endswith("end.")
    assert with_interval({"median": 1.0, "low": np.nan, "high": np.nan}) == "1"


def test_the_interval_of_a_median_holds_it_as_often_as_it_says() -> None:
    rng = np.random.default_rng(6)
    held = [low <= 0 <= high for low, high in (median_interval(rng.normal(size=25)) for _ in range(60))]
    assert 0.85 <= np.mean(held) <= 1
    assert np.isnan(median_interval(np.arange(5.0))).all()


def flights(n: int, rng: np.random.Generator) -> pd.DataFrame:
    """Flights whose error bars are right, twice the bound; one more has no measurement."""
    rows = []
    for k in range(n + 1):
        error = {c: rng.normal(0, s) for c, s in SIGMA.items()}
        row = {"point": 1, "converged": k < n, "status": "converged" if k < n else "ambiguous", "speed_ms": 2.0, "spin_rads": 100.0}
        for q in QUANTITIES:
            size, sigma = (float(np.linalg.norm([values[c] for c in q.components])) for values in (error, SIGMA))
            row |= {q.column: size if k < n else np.nan, f"sigma_{q.key}_percent": 100 * sigma / row[q.of]}
        row |= {f"pull_{c}": error[c] / SIGMA[c] if k < n else np.nan for c in COMPONENTS} | {
            f"true_bound_{c}": SIGMA[c] / 2 for c in COMPONENTS
        }
        rows.append(row)
    return pd.DataFrame(rows)


def test_right_error_bars_predict_the_median() -> None:
    points = medians(flights(1500, np.random.default_rng(5)), ("point",)).set_index("quantity")
    np.testing.assert_allclose(points["predicted"] / points["median"], 1, atol=0.1)
    np.testing.assert_allclose(points["bound"] / points["predicted"], 0.5)
    np.testing.assert_allclose(points["coverage"], 0.95, atol=0.02)
    np.testing.assert_allclose(points["pull"], 1, atol=0.05)
    assert (points["n"] == 1501).all()
    assert (points["measured"] == 1500).all()


def test_what_was_not_measured_is_told() -> None:
    rows = flights(20, np.random.default_rng(5))
    assert lost_in_words(rows) == "Of 21 measurements 1 are none, with a status that says so: 1 *ambiguous*."
    assert "All 20 measurements converged." in lost_in_words(rows[:-1])
    assert "of the components of ω" in held_in_words(rows)


def test_a_law_has_its_exponents_within_their_intervals_whatever_the_draws_luck() -> None:
    rng, held = np.random.default_rng(3), []
    for _ in range(60):
        rows = pd.DataFrame(
            {"frames": rng.choice([25.0, 50.0, 100.0], 60), "views": rng.choice([18.0, 60.0], 60), "draw": np.arange(60) // 6}
        )
        luck = rng.normal(0, 1, 10)[rows["draw"]]
        y = np.exp(luck + rng.normal(0, 0.5, 60)) * rows["frames"] ** -1.5 * rows["views"] ** -0.5
        (frames, views), scatter = power_law(rows, y.to_numpy(), ("frames", "views"), "draw")
        held += [frames.low <= -1.5 <= frames.high, views.low <= -0.5 <= views.high]
        assert 0.3 < scatter < 0.7
    assert 0.9 <= np.mean(held) <= 0.99


def test_a_law_of_too_few_rows_states_no_interval() -> None:
    rows = pd.DataFrame({"frames": [1.0, 2.0], "draw": [0, 0]})
    (exponent,), _ = power_law(rows, np.array([1.0, 4.0]), ("frames",), "draw")
    assert exponent.value == pytest.approx(2.0)
    assert np.isnan(exponent.low)
