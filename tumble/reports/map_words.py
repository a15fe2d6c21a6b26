"""Maps of residuals in plain words: where, in which direction, how much, and whether it grows."""

import numpy as np
from numpy.typing import NDArray

from estimator.diagnosis.residual_maps import ResidualMap
from estimator.reports.misfit_words import p_words

Index = NDArray[np.int64]
STRONG = 3.0
"""Standard errors from which a bin is told."""
TREND = 0.8
SIGNS = {
    "offset": ("outlines are larger than the model's", "outlines are smaller than the model's"),
    "along_v": ("outlines are displaced along +v", "outlines are displaced along −v"),
    "along_x": ("outlines are displaced to the right (+x)", "outlines are displaced to the left (−x)"),
    "along_y": ("outlines are displaced downwards (+y)", "outlines are displaced upwards (−y)"),
    "position_along": ("measured positions are ahead of the model's, along +v", "measured positions are behind the model's, along −v"),
    "turn_along": ("the measured body has turned further than the model's", "the measured body has turned less far than the model's"),
    "spin_along": ("the measured body spins faster than the model's", "the measured body spins more slowly than the model's"),
    **{f"spin_{a}": (f"measured spins point further towards +{a}", f"measured spins point further towards −{a}") for a in "xyz"},
    **{f"position_{a}": (f"measured positions lie towards +{a}", f"measured positions lie towards −{a}") for a in "xyz"},
    **{f"turn_{a}": (f"the measured body is turned about +{a}", f"the measured body is turned about −{a}") for a in "xyz"},
}
TITLES = {
    "offset": "outwards",
    "along_v": "along v",
    "along_x": "along x",
    "along_y": "along y",
    "position_along": "position along v",
    "turn_along": "turn about the spin",
    "spin_along": "size of the spin",
    **{f"spin_{a}": f"spin about {a}" for a in "xyz"},
    **{f"position_{a}": f"position along {a}" for a in "xyz"},
    **{f"turn_{a}": f"turn about {a}" for a in "xyz"},
}
COMPASS = ("right", "lower right", "down", "lower left", "left", "upper left", "up", "upper right")


def title_of(found: ResidualMap) -> str:
    """A map's title."""
    return f"{TITLES[found.kind]}, over {found.axis.title}"


def sentence_of(found: ResidualMap) -> str:
    """What a map shows, in a sentence."""
    if not found.significant:
        return f"Over {found.axis.title}: nothing that noise would not do (p = {found.p:.2g}, corrected for the number of maps)."
    first, last = strongest_run(found)
    rows = np.arange(first, last + 1, dtype=np.int64)
    worst = rows[np.argmax(np.abs(found.mean_px[rows]))]
    sign = SIGNS[found.kind][0 if found.mean_px[worst] > 0 else 1]
    size = f"{found.mean_px[worst]:+.3f} ± {found.sigma_px[worst]:.3f} {found.unit}"
    others = _others(found, rows)
    return f"{sign[0].upper()}{sign[1:]} {where(found, first, last)} ({size}){_trend(found)}{others} ({p_words(found.p)})."


def strongest_run(found: ResidualMap) -> tuple[int, int]:
    """First and last bin of the run of strong bins of one sign about the strongest one."""
    z = found.mean_px / found.sigma_px
    top = int(np.argmax(np.abs(z)))
    if found.axis.edges is None:
        return top, top
    alike = (np.abs(z) > STRONG) & (np.sign(z) == np.sign(z[top]))
    alike[top] = True
    first = last = top
    while first > 0 and alike[first - 1] and found.bins[first - 1] == found.bins[first] - 1:
        first -= 1
    while last + 1 < len(z) and alike[last + 1] and found.bins[last + 1] == found.bins[last] + 1:
        last += 1
    return first, last


def _others(found: ResidualMap, told: Index) -> str:
    """How many other bins are strong, the other way round or alike."""
    z = found.mean_px / found.sigma_px
    strong = np.setdiff1d(np.flatnonzero(np.abs(z) > STRONG), told)
    opposite = [int(i) for i in strong if np.sign(z[i]) != np.sign(z[told[0]])]
    if not opposite:
        return ""
    best = max(opposite, key=lambda i: abs(z[i]))
    return f", the other way {where(found, best, best)} ({found.mean_px[best]:+.3f} ± {found.sigma_px[best]:.3f} {found.unit})"


def _trend(found: ResidualMap) -> str:
    """Whether it grows or falls over an axis that has an order."""
    if found.axis.edges is None or len(found.bins) < 5:
        return ""
    r = rank_correlation(found.centre, found.mean_px)
    grown = rank_correlation(found.centre, np.abs(found.mean_px))
    if grown > TREND and abs(r) > TREND:
        return f", growing with {found.axis.title}"
    if grown < -TREND and abs(r) > TREND:
        return f", falling with {found.axis.title}"
    if abs(r) > TREND:
        return f", changing steadily with {found.axis.title}"
    return ""


def rank_correlation(x: NDArray[np.float64], y: NDArray[np.float64]) -> float:
    """Of two columns (n,) of numbers [Spearman 1904]; not a number where one of them is constant."""
    ranks = [_ranks(x), _ranks(y)]
    return float(np.asarray(np.corrcoef(ranks))[0, 1]) if all(np.ptp(each) > 0.0 for each in ranks) else float("nan")


def _ranks(x: NDArray[np.float64]) -> NDArray[np.float64]:
    """Ranks (n,) from 1 on; numbers that are equal share the mean of theirs."""
    _, place, count = np.unique(x, return_inverse=True, return_counts=True)
    return np.asarray((np.cumsum(count) - 0.5 * (count - 1))[place])


def where(found: ResidualMap, first: int, last: int) -> str:
    """The place of a run of bins."""
    axis, a, b = found.axis, found.bins[first], found.bins[last]
    second = 0.0 if axis.second is None else float(axis.second[a])
    centre = float(axis.centre[a])
    match axis.name:
        case "outline_direction":
            return f"where they face {COMPASS[round(centre / 45.0) % 8]} ({centre:.0f}° from x to y)"
        case "body_direction":
            return f"on the particle's side at longitude {centre:.0f}°, latitude {second:.0f}° (body axes)"
        case "place":
            return f"around ({centre:.0f}, {second:.0f}) px of the picture"
        case "view":
            return f"in pairs with calibrated view {centre:.0f}"
        case "spin_phase":
            return f"{centre:.0f}° after the first frame's orientation"
    low, high = (float(axis.edges[a]), float(axis.edges[b + 1])) if axis.edges is not None else (centre, centre)
    match axis.name:
        case "time":
            return f"in frames {np.ceil(low):.0f} to {np.floor(high):.0f}"
        case "radius":
            return f"{low:.0f} to {high:.0f} px from the principal point"
        case "speed":
            return f"at speeds of {low:.2f} to {high:.2f} m/s"
    return f"at {low:.3g} to {high:.3g} {axis.unit}"
