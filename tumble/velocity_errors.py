"""Velocities of a fitted campaign beside the truth, for ladders of made-up recordings."""

from pathlib import Path
from typing import Any

import numpy as np

from datasets.truth_files import read_truth
from estimator.fitting.campaigns.campaign import CampaignFit
from estimator.fitting.campaigns.forced_velocities import motion_under
from tumble.campaigning import Prepared


def velocity_errors(fit: CampaignFit, campaign: Prepared, truth: Path) -> dict[str, Any]:
    """Median over the sequences of the errors of v and omega in the middle (of a drop: at reference times), % of their size."""
    linear, angular = [], []
    of = campaign.registered.campaign
    for number, sequence in enumerate(of.sequences):
        found = motion_under(fit.state.flights[number], fit.model, fit.state.theta[number], sequence.setting)
        true = read_truth(truth / of.recordings[number]).motion
        middle = (len(true.times_s) - 1) // 2
        k = int(np.argmin(np.abs(true.times_s - fit.state.flights[number].time_s))) if of.recording else middle
        linear.append(np.linalg.norm(found.v_world[k] - true.v_world[k]) / max(float(np.linalg.norm(true.v_world[k])), 1e-12))
        angular.append(np.linalg.norm(found.omega_world[k] - true.omega_world[k]) / max(float(np.linalg.norm(true.omega_world[k])), 1e-12))
    return {"v_percent": 100.0 * float(np.median(linear)), "omega_percent": 100.0 * float(np.median(angular))}
