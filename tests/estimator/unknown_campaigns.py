"""Small campaigns with forces that the estimator has no model of, at a clear size."""

from dataclasses import replace
from functools import cache

from datasets.recipes.recipe import EffectRecipe, Recipe, RigRecipe
from estimator.data.configuration import Configuration
from estimator.fitting.campaigns.registered import Registered
from estimator.measurements.silhouettes.registration import register
from synth.sequence import build_silhouette_sequence
from tests.estimator.small_campaign import recipe

FRAMES = {"outgassing_thrust": 30, "wall_attraction": 40, "thermal_focus_drift": 40}
THRUST = {"a1": 20.0, "a2": -10.0, "a3": 15.0}
WALL = {"strength": 0.01, "normal_x": 1.0, "normal_y": 0.0, "normal_z": 0.0, "position": -0.05}
DRIFT = {"relative": 0.05, "time_constant": 0.01}
FORCES = {"outgassing_thrust": {**THRUST, "arm1": 3e-4}, "wall_attraction": WALL}
HIDDEN = {**FORCES, "thermal_focus_drift": DRIFT}


def unknown_recipe(key: str) -> Recipe:
    return replace(recipe(EffectRecipe(key, HIDDEN[key]), frames=FRAMES[key]), rig=RigRecipe(drops=4))


@cache
def unknown_campaign(key: str) -> Registered:
    made = unknown_recipe(key)
    return register([build_silhouette_sequence(made, i)[0] for i in range(made.sequences)], Configuration())
