"""How far sizes of what moves outlines are off on bodies with hollows, whose corners a carved hull shows in part.

``python -m scripts.trials.study_sizes_at_spikes [--bodies 6] [--seed N] [--result docs/results/sizes_at_spikes.json
--page docs/studies/sizes_at_spikes.md]``. Jagged bodies are calibrated and filmed with one effect after the other, and the campaign is
fitted with that effect from its true value. Seeds are drawn unless one is given.
"""

import json
from dataclasses import replace
from typing import Any

import numpy as np

from datasets.recipes.recipe import EffectRecipe, HsvRecipe, MotionRecipe, ParticleRecipe, Recipe, RigRecipe
from estimator.data.configuration import Configuration
from estimator.effects.model import Model
from estimator.effects.registry import MODELS
from estimator.fitting.campaigns.campaign import CampaignState, fit_campaign
from estimator.fitting.campaigns.campaign_covariance import campaign_covariance
from estimator.fitting.campaigns.following import following
from estimator.measurements.silhouettes.registration import register
from estimator.motion.flight import N_PARAMETERS
from scripts.trials.body_studies import LARGEST_SEED, body_study_arguments, write_body_study
from synth.sequence import build_silhouette_sequence

RECIPE = Recipe(
    motion=MotionRecipe(frames=40, frame_rate_hz=2000.0, speed_ms=(0.0, 4.0), spin_rads=(0.0, 300.0)),
    hsv=HsvRecipe(exposure_us=50.0),
    rig=RigRecipe(drops=7),
)
SEQUENCES = 3
SIZES = {
    "outline_offset": ("offset", (-1.0, -0.4, 0.4, 1.0)),
    "blooming": ("loss", (0.8, 1.8)),
    "motion_blur_threshold": ("bias", (-0.3, 0.3)),
    "defocus_growth": ("blur", (30.0, 80.0)),
    "rim_light_leak": ("loss", (0.5, 1.0)),
}
IRREGULARITY = (0.3, 0.8)


def one_fit(recipe: Recipe, key: str, size: float) -> dict[str, Any]:
    """A campaign with one effect: what its size comes out as, and the standard deviation of noise."""
    name, _ = SIZES[key]
    made = replace(recipe, effects=(EffectRecipe(key, {name: size}),))
    registered = register([build_silhouette_sequence(made, i)[0] for i in range(SEQUENCES)], Configuration(campaign_surface_fit=0))
    base = registered.campaign.kind.base
    model = Model((*base.effects, MODELS[key]))
    start = CampaignState(registered.start.flights, tuple(np.append(np.zeros(base.size), size) for _ in registered.start.flights))
    campaign, fit = following(registered.campaign, fit_campaign(registered.campaign, start, model))
    variance = campaign_covariance(campaign, fit).of(0, np.array([N_PARAMETERS + base.size]))[0, 0]
    hollow = float(np.mean([campaign.kind.hollow(sequence) for sequence in campaign.sequences]))
    value = float(fit.state.theta[0][-1])
    return {"effect": key, "true": size, "value": value, "sigma_of_noise": float(np.sqrt(variance)), "hollow": hollow}


def summary(rows: list[dict[str, Any]]) -> dict[str, dict[str, float]]:
    """Per effect: root mean square of the relative errors, of the part that noise makes, and of pulls with what is reported."""
    found = {}
    for key in SIZES:
        mine = [row for row in rows if row["effect"] == key]
        if not mine:
            continue
        off = np.array([row["value"] / row["true"] - 1.0 for row in mine])
        noise = np.array([row["sigma_of_noise"] / abs(row["true"]) for row in mine])
        reported = [MODELS[key].reported(np.array([r["value"]]), np.array([r["sigma_of_noise"] ** 2]), r["hollow"])[1][0] for r in mine]
        pulls = np.array([(r["value"] - r["true"]) / s for r, s in zip(mine, reported, strict=True)])
        found[key] = {"error": _rms(off), "noise": _rms(noise), "mean": float(off.mean()), "pull": _rms(pulls), "campaigns": len(mine)}
    return found


def _rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2)))


def page(result: dict[str, Any]) -> list[str]:
    """The figures as lines of a page."""
    return [
        "# Sizes of what moves outlines, on bodies with hollows",
        "",
        f"Written by `python -m scripts.trials.study_sizes_at_spikes` with seed {result['seed']}: {result['bodies']} jagged bodies, each",
        "filmed with every effect in turn and fitted with it from its true value. Relative errors of the size (root mean square, and",
        "mean), the part of noise in them, and pulls with the standard deviation that is reported, which counts what a hull does not",
        "show of corners.",
        "",
        "| effect | campaigns | error | mean | noise | pull |",
        "| --- | --- | --- | --- | --- | --- |",
        *(
            f"| {key.replace('_', ' ')} | {each['campaigns']:.0f} | {each['error']:.2f} | {each['mean']:+.2f} | {each['noise']:.2f} "
            f"| {each['pull']:.2f} |"
            for key, each in result["summary"].items()
        ),
    ]


def main() -> int:
    """Fit the campaigns, print and write what was found."""
    arguments = body_study_arguments(__doc__, 6)
    rng = np.random.default_rng(arguments.seed)
    rows: list[dict[str, Any]] = []
    for _ in range(arguments.bodies):
        particle = ParticleRecipe(family="jagged", irregularity=float(rng.uniform(*IRREGULARITY)))
        recipe = replace(RECIPE, seed=int(rng.integers(LARGEST_SEED)), particle=particle)
        for key, (_, sizes) in SIZES.items():
            rows.append(one_fit(recipe, key, float(rng.choice(sizes))))
            print(json.dumps(rows[-1]), flush=True)
    result = {"seed": arguments.seed, "bodies": arguments.bodies, "summary": summary(rows), "campaigns": rows}
    print(json.dumps(result["summary"], indent=1))
    write_body_study(result, page, arguments)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
