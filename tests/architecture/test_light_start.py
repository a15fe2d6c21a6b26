"""What a verb's module must not import: libraries of which a run needs nothing, or not before it has something to draw or to weigh."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from scipy import special, stats

from estimator.effects.catalogue.exposure import motion_blur_threshold
from tumble.reports.map_words import rank_correlation

ROOT = Path(__file__).resolve().parents[2]
HEAVY = ("matplotlib", "mitsuba", "networkx", "pandas", "scipy.signal", "scipy.stats", "trimesh")
"""Each takes 0.1 to 0.5 s of CPU to import."""


@pytest.mark.parametrize("modules", ["tumble.cli.estimate", "tumble.cli.explain, tumble.reports.campaign_page"])
def test_a_verb_starts_without_heavy_libraries(modules: str) -> None:
    code = f"import sys, {modules}; print(*[name for name in {HEAVY!r} if name in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True)
    assert done.stdout.split() == []


def test_ranks_are_correlated_as_by_scipy() -> None:
    rng = np.random.default_rng(3)
    x, y = rng.integers(0, 6, 20).astype(np.float64), rng.normal(size=20)
    assert rank_correlation(x, y) == pytest.approx(stats.spearmanr(x, y).statistic, rel=1e-12)
    assert np.isnan(rank_correlation(np.ones(20), y))


def test_the_integral_of_the_normal_distribution_is_that_of_scipy() -> None:
    z = np.linspace(-8.0, 8.0, 101)
    expected = z * stats.norm.cdf(z) + stats.norm.pdf(z)
    np.testing.assert_allclose(motion_blur_threshold._integral(z), expected, rtol=1e-12, atol=1e-300)


@pytest.mark.parametrize("degrees", [1, 2, 3.7, 24, 600])
def test_tails_of_scipys_functions_are_those_of_its_distributions(degrees: float) -> None:
    statistic = degrees * np.array([0.0, 1e-3, 0.5, 1.0, 2.0, 40.0, np.inf])
    np.testing.assert_allclose(special.chdtrc(degrees, statistic), stats.chi2.sf(statistic, degrees), rtol=1e-12)
    np.testing.assert_allclose(special.fdtrc(degrees, 11.0, statistic), stats.f.sf(statistic, degrees, 11.0), rtol=1e-12)
    p = np.array([1e-9, 0.05, 0.5, 0.95, 0.999])
    np.testing.assert_allclose(special.chdtri(degrees, p), stats.chi2.isf(p, degrees), rtol=1e-12)
    np.testing.assert_allclose(special.chdtri(degrees, 1.0 - p[1:]), stats.chi2.ppf(p[1:], degrees), rtol=1e-12)
