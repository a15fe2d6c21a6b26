"""Drag and lift of real table tennis balls by a direct regression, beside which ``tumble explain`` is held.

``python -m scripts.real.study_table_tennis --data FOLDER``; FOLDER holds ``table_tennis/`` as its publishers gave it (Gossard et al. 2023),
which is not part of Tumble. Nothing of Tumble is used, only numpy and SciPy, in two steps:

1. Every shot has a position, a velocity and a lift ``W x v`` of its own, all share the drag ``k |v| v``; Huber's loss, since some rows are
   wrong. The measured spins are not used.
2. ``W = C omega / (1 + l |omega| / |v|)`` across the flight, beside what a wrong spin makes of it: Student's density, of three degrees of
   freedom and of one, and a scale that is fitted, since some spins are wrong by far more than was stated.
3. With frames at even times and a drag of every shot: each spin is either right, W as in 2 with a normal scatter, or wrong, W then as of
   any shot and nothing to do with the spin: how much more likely that makes the 37 lifts, and which spins are wrong.
4. The first step again with frames at even times: what is left along y where stamps are early, and what a stretch of the volume is worth.
5. As in 3, and W has a part along the flight, which shows as the flight bends. How drags go with lifts: ``k = k_0 + ratio |W| / |v|`` by
   Cauchy's density, beside the measured spins.
"""

import argparse
import csv
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import OptimizeResult, minimize
from scipy.special import expit

Array = NDArray[np.float64]
GRAVITY = np.array([0.0, 0.0, -9.81])
SUBSTEPS = 2
"""Steps of fourth order from row to row, 7 ms: an error of less than a micrometre."""
STEPS = np.concatenate([np.full(3, 1e-5), np.full(3, 1e-4), np.full(3, 1e-4), [1e-4]])
"""For derivatives by position (m), velocity (m/s), W (1/s) and drag (1/m)."""
HUBER = 3.0
TAILS = (3.0, 1.0)
"""Degrees of freedom of Student's density; 1: that of Cauchy, as ``tumble explain`` has it for spins that were read once."""
ROUNDS = 20
ALONG, ANY = 1e-3, 1.0
"""Standard deviation (1/s) of W along the flight, of which little shows: none, and whatever it is."""
BEGIN = np.array([2.5e-3, 0.02, -2.0])
"""Lift, its length (m) and the logarithm of the scatter (1/s) that wrong spins bring."""
EITHER = {"scatter of right ones": -2.5, "of wrong ones": -1.0, "odds of a right one": 0.5}
"""Where the search in 3 begins, all logarithms; scatters in 1/s."""
WRONG = 0.5
"""Share of its size that a spin has to be off to be printed."""
INTERVAL_S = 6.932e-3
"""From frame to frame: that by which the stamps of all shots are nearest to even times."""
EARLY_M = (0.0, 0.35)
"""Where along y stamps are early."""


@dataclass(frozen=True)
class Shot:
    """Times (n,) s, positions (n, 3) m and the measured spin (3,) rad/s."""

    name: str
    times_s: Array
    x: Array
    spin: Array


@dataclass
class Fit:
    """``own`` (s, 9) position, velocity and W of every shot, with covariances (s, 9, 9); ``drag`` and its ``sigma``; ``noise`` (3,) m."""

    own: Array
    covariance: Array
    drag: float
    sigma: float
    noise: Array


def shots_in(folder: Path) -> list[Shot]:
    """The shots with their spins."""
    spins = {row[0]: np.array(row[1:], dtype=np.float64) for row in _rows(folder / "spins.csv")}
    rows: dict[str, list[list[float]]] = {}
    for name, *row in _rows(folder / "flights.csv"):
        rows.setdefault(name, []).append([float(each) for each in row])
    return [Shot(name, np.array(each)[:, 0], np.array(each)[:, 1:], spins[name]) for name, each in rows.items()]


def _rows(path: Path) -> list[list[str]]:
    return list(csv.reader(path.read_text().splitlines()))[1:]


def pushed(v: Array, W: Array, drag: Array) -> Array:
    """Accelerations (m, 3) of m balls at velocities (m, 3) with lifts W (m, 3) and drags (m, 1)."""
    return np.asarray(GRAVITY - drag * np.linalg.norm(v, axis=1, keepdims=True) * v + np.cross(W, v))


def flown(times_s: Array, tried: Array) -> Array:
    """Positions (m, n, 3) of m balls (m, 10) side by side, by Runge and Kutta's steps."""
    x, v, W, drag = tried[:, :3], tried[:, 3:6], tried[:, 6:9], tried[:, 9:]
    found = [x]
    for step in np.diff(times_s) / SUBSTEPS:
        for _ in range(SUBSTEPS):
            a = pushed(v, W, drag)
            b = pushed(v + 0.5 * step * a, W, drag)
            c = pushed(v + 0.5 * step * b, W, drag)
            d = pushed(v + step * c, W, drag)
            x = x + step * v + step**2 / 6.0 * (a + b + c)
            v = v + step / 6.0 * (a + 2.0 * b + 2.0 * c + d)
        found.append(x)
    return np.stack(found, axis=1)


def linearised(shot: Shot, own: Array, drag: float) -> tuple[Array, Array]:
    """Residuals (n, 3) m of positions, and their derivatives (n, 3, 10)."""
    at, q = np.append(own, drag), len(STEPS)
    x = flown(shot.times_s, np.vstack([at, at + np.diag(STEPS), at - np.diag(STEPS)]))
    return x[0] - shot.x, np.moveaxis(x[1 : q + 1] - x[q + 1 :], 0, -1) / (2.0 * STEPS)


def begun(shots: list[Shot]) -> Fit:
    """Parabolas without lift."""
    own = [np.concatenate([s.x[0], np.polyfit(s.times_s, s.x, 2)[1], np.zeros(3)]) for s in shots]
    return Fit(np.array(own), np.zeros((len(own), 9, 9)), 0.15, 0.0, np.full(3, 5e-3))


def improved(shots: list[Shot], fit: Fit, along: float) -> Fit:
    """One step of Gauss and Newton, with the weights that the residuals ask for; ``along``: a prior, as ``ALONG``."""
    information, pull, backs, covariances, residuals = 0.0, 0.0, [], [], []
    for shot, own in zip(shots, fit.own, strict=True):
        e, J = linearised(shot, own, fit.drag)
        residuals.append(e)
        weight = 1.0 / np.maximum(np.abs(e) / fit.noise / HUBER, 1.0) / fit.noise**2
        H, g = np.einsum("nij,ni,nik->jk", J, weight, J), np.einsum("nij,ni,ni->j", J, weight, e)
        u = own[3:6] / np.linalg.norm(own[3:6])
        H[6:9, 6:9] += np.outer(u, u) / along**2
        g[6:9] += u * (u @ own[6:9]) / along**2
        covariances.append(np.linalg.inv(H[:9, :9]))
        backs.append(covariances[-1] @ np.column_stack([H[:9, 9], g[:9]]))
        information += H[9, 9] - H[9, :9] @ backs[-1][:, 0]
        pull += g[9] - H[9, :9] @ backs[-1][:, 1]
    step = -pull / information
    moved = np.array([own - back[:, 1] - back[:, 0] * step for own, back in zip(fit.own, backs, strict=True)])
    noise = 1.4826 * np.median(np.abs(np.concatenate(residuals)), axis=0)
    return Fit(moved, np.array(covariances), fit.drag + step, float(information**-0.5), noise)


def off(shot: Shot, own: Array, lift: float, length: float) -> tuple[Array, Array, Array]:
    """W beyond that of the measured spin (2,) 1/s, the directions across the flight (2, 3), and what one rad/s gives (1/s)."""
    speed = np.linalg.norm(own[3:6])
    across = np.linalg.svd(own[None, 3:6])[2][1:]
    per_rads = lift / max(1.0 + length * np.linalg.norm(shot.spin) / speed, 0.1)
    return across @ (own[6:9] - per_rads * shot.spin), across, np.asarray(per_rads)


def cost(at: Array, shots: list[Shot], fit: Fit, tails: float) -> float:
    """Minus the logarithm of the density of all W at lift, length and scatter, up to a constant for each number of ``tails``."""
    total = 0.0
    for shot, own, covariance in zip(shots, fit.own, fit.covariance, strict=True):
        away, across, _ = off(shot, own, at[0], at[1])
        C = across @ covariance[6:9, 6:9] @ across.T + np.exp(2.0 * at[2]) * np.eye(2)
        squares = float(away @ np.linalg.solve(C, away))
        total += 0.5 * (tails + 2.0) * np.log1p(squares / tails) + 0.5 * np.linalg.slogdet(C)[1]
    return float(total)


def spread_of(at: Array, shots: list[Shot], fit: Fit, tails: float) -> Array:
    """Standard deviations (3,) from the curvature of the cost."""
    h = np.array([2e-5, 1e-3, 2e-2])
    steps = np.diag(h)
    H = np.array(
        [[sum(a * b * cost(at + a * i + b * j, shots, fit, tails) for a in (1, -1) for b in (1, -1)) for j in steps] for i in steps]
    )
    return np.sqrt(np.diag(np.linalg.inv(H / 4.0 / np.outer(h, h))))


def ways(at: Array, shots: list[Shot], fit: Fit) -> Array:
    """Logarithm of the density (s, 2) of every W with its probability: the spin is right, or wrong; ``at`` (5,) as in :func:`either`."""
    found = []
    for shot, own, covariance in zip(shots, fit.own, fit.covariance, strict=True):
        away, across, _ = off(shot, own, at[0], at[1])
        for W, scatter, odds in ((away, at[2], at[4]), (across @ own[6:9], at[3], -at[4])):
            C = across @ covariance[6:9, 6:9] @ across.T + np.exp(2.0 * scatter) * np.eye(2)
            found.append(np.log(expit(odds)) - 0.5 * W @ np.linalg.solve(C, W) - 0.5 * np.linalg.slogdet(C)[1])
    return np.array(found).reshape(-1, 2)


def either(shots: list[Shot], fit: Fit, *, saturates: bool, lifts: bool = True) -> OptimizeResult:
    """Lift, its length, logarithms of both scatters and of the odds of a spin to be right; ``fun``: minus the log likelihood."""
    free = np.array([lifts, saturates, True, lifts, lifts])
    begin = np.array([BEGIN[0] * lifts, BEGIN[1] * saturates, *EITHER.values()])
    begin[4] = begin[4] if lifts else 50.0

    def less(moved: Array) -> float:
        at = begin.copy()
        at[free] = moved
        return -float(np.logaddexp.reduce(ways(at, shots, fit), axis=1).sum())

    options = {"xatol": 1e-7, "fatol": 1e-7, "maxiter": 4000, "maxfev": 8000}
    found = minimize(less, begin[free], method="Nelder-Mead", options=options)
    at = begin.copy()
    at[free] = found.x
    return OptimizeResult(x=at, fun=found.fun)


def told_either(shots: list[Shot], fit: Fit) -> None:
    """Print what 3 says."""
    best, plain = either(shots, fit, saturates=True), either(shots, fit, saturates=False)
    none = either(shots, fit, saturates=False, lifts=False)
    print("at even times, with a drag of every shot, where a spin is either right or wrong:")
    print(f"  {expit(best.x[4]):.0%} are right; lift {1e3 * best.x[0]:.1f} e-3, saturating over {1e3 * best.x[1]:.0f} mm: a spin of")
    per = [best.x[0] / (1.0 + best.x[1] * spin / 8.0) for spin in (80.0, 200.0, 400.0)]
    print(f"  80, 200, 400 rad/s at 8 m/s lifts by {', '.join(f'{1e3 * each:.2f}' for each in per)} e-3 of it")
    print(f"  scatter {np.exp(best.x[2]):.3f} 1/s of right ones, {np.exp(best.x[3]):.3f} 1/s of wrong ones")
    print(f"  more likely by {plain.fun - best.fun:.1f} nats than without saturation (lift {1e3 * plain.x[0]:.2f} e-3)")
    print(f"  more likely by {none.fun - best.fun:.1f} nats than where no spin says anything")
    rows = ways(best.x, shots, fit)
    wrong = [shot.name for shot, (right, other) in zip(shots, rows, strict=True) if other > right]
    print(f"  more probably wrong than right: {', '.join(wrong)}")


def at_even_times(shot: Shot) -> Shot:
    """The shot with the even time nearest to each stamp in its place; of stamps nearest to the same one the first is taken to be late."""
    t, rows = shot.times_s, np.arange(len(shot.times_s))
    phase = np.angle(np.exp(2j * np.pi * t / INTERVAL_S).mean()) / (2.0 * np.pi) * INTERVAL_S
    number = np.round((t - phase) / INTERVAL_S) - rows
    number = np.minimum.accumulate(number[::-1])[::-1] + rows
    return replace(shot, times_s=INTERVAL_S * (number - number[0]))


def fitted(shots: list[Shot], along: float = ALONG) -> Fit:
    """All shots with one drag."""
    fit = begun(shots)
    for _ in range(ROUNDS):
        fit = improved(shots, fit, along)
    return fit


def each_alone(shots: list[Shot]) -> Fit:
    """All shots, each with a drag of its own."""
    fits = [fitted([shot]) for shot in shots]
    own, covariance = (np.concatenate([getattr(fit, name) for fit in fits]) for name in ("own", "covariance"))
    return Fit(own, covariance, *np.mean([(fit.drag, fit.sigma) for fit in fits], axis=0), np.median([fit.noise for fit in fits], axis=0))


def told_of_drags(shots: list[Shot]) -> None:
    """Print what 5 says."""
    fits = [fitted([shot], ANY) for shot in shots]
    v = [fit.own[0, 3:6] for fit in fits]
    speed = np.array([np.linalg.norm(shot.x[-1] - shot.x[0]) / np.ptp(shot.times_s) for shot in shots])
    lifts = np.array([np.linalg.norm(np.cross(fit.own[0, 6:9], each)) / np.linalg.norm(each) for fit, each in zip(fits, v, strict=True)])
    spins = np.array([np.linalg.norm(shot.spin) for shot in shots])
    drag, sigma = (np.array([getattr(fit, name) for fit in fits]) for name in ("drag", "sigma"))

    def off(at: Array, by: Array) -> float:
        """Minus the logarithm of the density of all drags at k_0, ratio and the logarithm of a scatter."""
        variance = sigma**2 + np.exp(2.0 * at[2])
        return float(np.sum(np.log1p((drag - at[0] - at[1] * by / speed) ** 2 / variance) + 0.5 * np.log(variance)))

    none = minimize(lambda at: off(np.array([at[0], 0.0, at[1]]), lifts), [0.14, -5.0], method="Nelder-Mead")
    for said, by, first in (("lift", lifts, 0.3), ("the measured spin", spins, 3e-4)):
        best = minimize(off, np.array([0.13, first, -5.0]), args=(by,), method="Nelder-Mead", options={"maxiter": 4000})
        told = f"drag {best.x[0]:.4f} 1/m + {best.x[1]:.3g} x {said} / |v|, scatter {np.exp(best.x[2]):.4f} 1/m"
        print(f"  {told}: more likely by {none.fun - best.fun:.1f} nats than one drag")


def distortion(shots: list[Shot], fit: Fit) -> tuple[float, float]:
    """``k`` of a volume stretched by ``k |u|^2 u`` about its middle, ``u`` over the mean distance, and its spread from shot to shot."""
    every = np.concatenate([shot.x for shot in shots])
    reach = np.sqrt(np.mean(np.sum((every - every.mean(axis=0)) ** 2, axis=1)))
    pulls, informations = [], []
    for shot, own in zip(shots, fit.own, strict=True):
        e, J = linearised(shot, own, fit.drag)
        u = (shot.x - every.mean(axis=0)) / reach
        column = reach * np.sum(u**2, axis=1, keepdims=True) * u
        near = np.abs(e) < HUBER * fit.noise
        X, y, c = (each[near] for each in (J / fit.noise[:, None], e / fit.noise, column / fit.noise))
        left = c - X @ np.linalg.lstsq(X, c, rcond=None)[0]
        pulls.append(-left @ y)
        informations.append(left @ left)
    total = float(np.sum(informations))
    k = float(np.sum(pulls)) / total
    return k, float(np.linalg.norm(np.array(pulls) - k * np.array(informations))) / total


def told_of_stamps(shots: list[Shot]) -> None:
    """Print what 4 says."""
    for said, used in (("by stamps", shots), ("by even times", [at_even_times(shot) for shot in shots])):
        fit = fitted(used)
        off = [-linearised(shot, own, fit.drag)[0][:, 1] for shot, own in zip(used, fit.own, strict=True)]
        there = [1e3 * e[(shot.x[:, 1] > EARLY_M[0]) & (shot.x[:, 1] < EARLY_M[1])] for e, shot in zip(off, used, strict=True)]
        halves = ", ".join(f"{np.median(np.concatenate(there[first::2])):.2f}" for first in (0, 1))
        ks = [distortion(each, fitted(each)) for each in (used, used[::2], used[1::2])]
        print(f"{said}: drag {fit.drag:.4f} 1/m, noise {(1e3 * fit.noise).round(2)} mm")
        print(f"  y between {EARLY_M[0]} and {EARLY_M[1]} m is off by {halves} mm (halves)")
        print("  stretch of the volume, all shots and halves: " + ", ".join(f"{1e3 * k:.2f} +- {1e3 * s:.2f} e-3" for k, s in ks))


def told_in_all(shots: list[Shot], fit: Fit, tails: float) -> None:
    """Print what 2 says."""
    options = {"xatol": 1e-7, "fatol": 1e-9, "maxiter": 2000}
    best = minimize(cost, BEGIN, args=(shots, fit, tails), method="Nelder-Mead", options=options).x
    sigma = spread_of(best, shots, fit, tails)
    print(f"with tails of {tails:.0f} degrees of freedom:")
    print(f"lift: {1e3 * best[0]:.2f} +- {1e3 * sigma[0]:.2f} e-3, saturating over {1e3 * best[1]:.1f} +- {1e3 * sigma[1]:.1f} mm")
    plain = minimize(lambda at: cost(np.insert(at, 1, 0.0), shots, fit, tails), BEGIN[[0, 2]], method="Nelder-Mead", options=options)
    print(f"without saturation: {1e3 * plain.x[0]:.2f} e-3, less likely by {plain.fun - cost(best, shots, fit, tails):.1f} nats")
    print(f"lift beside that of the measured spins scatters by {np.exp(best[2]):.3f} 1/s; spins are off by more than {WRONG:.0%} in:")
    for shot, own in zip(shots, fit.own, strict=True):
        away, across, per_rads = off(shot, own, best[0], best[1])
        if np.linalg.norm(away / per_rads) > WRONG * np.linalg.norm(shot.spin):
            print(f"  shot {shot.name}: measured {(across @ shot.spin).round(0)}, flown {(across @ own[6:9] / per_rads).round(0)} rad/s")


def main() -> int:
    """Fit, and print the values and the spins that are wrong."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=Path, required=True, help="the folder that holds table_tennis/")
    shots = shots_in(parser.parse_args().data / "table_tennis")
    fit = fitted(shots)
    print(f"drag: {fit.drag:.4f} +- {fit.sigma:.4f} 1/m; noise {(1e3 * fit.noise).round(2)} mm")
    for tails in TAILS:
        told_in_all(shots, fit, tails)
    even = [at_even_times(shot) for shot in shots]
    told_either(even, each_alone(even))
    told_of_stamps(shots)
    told_of_drags(even)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
