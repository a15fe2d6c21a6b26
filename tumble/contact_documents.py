"""A validation of contact models as a document (``contact_validation.json``); the report is made from this alone."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from datasets.json_documents import Document
from estimator.contact_validation.fitting import Fitted, Impacts
from estimator.contact_validation.heights import Heights
from estimator.contact_validation.held_out import Gain, Judged
from estimator.contact_validation.ladder import Candidate, Ladder, Rung
from estimator.contact_validation.quantities import ONE_CONTACT_P, Contact
from estimator.contact_validation.residual_maps import ResidualMap
from estimator.contact_validation.validate import Ranked, Validation
from estimator.contact_validation.verdict import ContactVerdict

FILE = "contact_validation.json"
KIND = "contact_validation"
Entry = dict[str, Any]
SEEN = 2.0
"""Standard deviations from which on lengths are said to differ."""


def validation_document(source: str, found: Validation, left_out: Mapping[str, str], broken: Sequence[str]) -> Document:
    """Everything that was found."""
    impacts, contacts = found.impacts, {contact.name: contact for contact in found.contacts}
    return {
        "source": source,
        "verdict": vars(found.verdict),
        "impacts": [_impact(impacts, k, contacts[impact.name], found) for k, impact in enumerate(impacts.measured)],
        "shared": list(found.shared),
        "models": [_model(ranked, impacts) for ranked in found.ranking],
        "ladder": _ladder(found.ladder),
        "maps": [_map(entry) for entry in found.maps],
        "detectable": [vars(entry) for entry in found.detectable],
        "left_out": dict(left_out),
        "broken": list(broken),
    }


def heights_entry(found: Heights) -> Entry:
    """Heights at impacts against the mesh, and what they say of lengths."""
    scale = f"{100.0 * found.scale:.2g} ± {100.0 * found.scale_sigma:.1g} %"
    differ = abs(found.scale) >= SEEN * found.scale_sigma
    amount = f"{abs(found.scale):.1%} {'less' if found.scale > 0.0 else 'more'} than" if differ else "those of"
    sentence = (
        f"Heights at {found.count} impacts are {amount} the mesh's ({scale}), and the plate lies at {1e3 * found.offset_m:.3g} ± "
        f"{1e3 * found.offset_sigma_m:.2g} mm along its normal."
    )
    if differ:
        corners = "rounder" if found.scale > 0.0 else "longer"
        sentence += (
            f" Recorded lengths are wrong, or corners are {corners} than the mesh's. Which, a height at rest tells: --known "
            "'rest_height=MEASURED±SIGMA' with --mesh."
        )
    return {**vars(found), "sentence": sentence}


def broken_document(source: str, left_out: Mapping[str, str], broken: Sequence[str], verdict: ContactVerdict) -> Document:
    """What is left to say where most runs broke."""
    empty: dict[str, list[Entry]] = {key: [] for key in ("impacts", "shared", "models", "maps", "detectable")}
    nothing: Entry = {**empty, "ladder": {"rungs": [], "alike": {}, "missing": []}}
    return {"source": source, "verdict": vars(verdict), **nothing, "left_out": dict(left_out), "broken": list(broken)}


def _impact(impacts: Impacts, k: int, contact: Contact, found: Validation) -> Entry:
    measured = impacts.measured[k]
    return {
        "name": measured.name,
        "run": measured.run,
        "experiment": measured.experiment,
        "v_before": measured.state.v_world,
        "omega_before": measured.state.omega_world,
        "after": measured.after,
        "after_sigma": np.sqrt(np.diag(measured.covariance)[12:]),
        "predicted_sigma": found.spread[k],
        "normal_world": measured.plate.normal_world,
        "point_body_m": contact.point_body,
        "corner_clearance_m": contact.corner_clearance_m,
        "u_before": contact.u_before,
        "u_before_sigma": contact.u_before_sigma,
        "u_after": contact.u_after,
        "u_after_sigma": contact.u_after_sigma,
        "normal_impulse_per_mass": list(contact.normal_impulse),
        "tangential_impulse_per_mass": list(contact.tangential_impulse),
        "impulse_ratio": list(contact.ratio),
        "restitution": list(contact.restitution),
        "angle_deg": float(np.degrees(contact.angle_rad)),
        "one_contact_p": contact.one_contact_p,
        "one_contact": contact.one_contact_p >= ONE_CONTACT_P,
    }


def _model(ranked: Ranked, impacts: Impacts) -> Entry:
    return {
        "key": ranked.model.key,
        "title": ranked.model.title,
        **_judged(ranked.judged),
        "behind": _gain(ranked.behind),
        "predicted": impacts.after - ranked.judged.residuals,
        "log_scores": -0.5 * ranked.judged.costs,
    }


def _judged(judged: Judged) -> Entry:
    return {
        "values": values(judged.fitted),
        "scatter": judged.fitted.scatter,
        "fitted_log_score": -0.5 * judged.fitted.cost,
        "held_out_log_score": -0.5 * judged.cost,
        "errors_alone_log_score": -0.5 * judged.expected_cost,
        "held_out_distance2": float(np.median(judged.distances2)),
    }


def values(fitted: Fitted) -> list[Entry]:
    """Fitted constants."""
    return [
        {"name": p.name, "value": float(v), "sigma": float(s), "unit": p.unit}
        for p, v, s in zip(fitted.model.parameters, fitted.values, fitted.sigmas, strict=True)
    ]


def _gain(gained: Gain | None) -> Entry | None:
    """In units of the log score, half a cost."""
    if gained is None:
        return None
    return {
        "log_score": 0.5 * gained.total,
        "interval": [0.5 * gained.low, 0.5 * gained.high],
        "chance": 0.5 * gained.chance,
        "agreement": gained.agreement,
        "beyond_chance": gained.beyond_chance,
    }


def _ladder(ladder: Ladder) -> Entry:
    return {
        "rungs": [_rung(rung) for rung in ladder.rungs],
        "alike": {key: list(keys) for key, keys in ladder.alike.items()},
        "missing": list(ladder.missing),
    }


def _rung(rung: Rung) -> Entry:
    return {
        "added": rung.added,
        "key": rung.key,
        "accepted": rung.accepted,
        "gained": _gain(rung.gained),
        **_judged(rung.judged),
        "candidates": [_candidate(c) for c in rung.candidates],
    }


def _candidate(candidate: Candidate) -> Entry:
    names = {p.name for p in candidate.physics.parameters}
    return {
        "key": candidate.physics.key,
        "title": candidate.physics.title,
        "meaning": candidate.physics.meaning,
        "values": [entry for entry in values(candidate.fitted) if entry["name"] in names],
        "fitted_log_score": -0.5 * candidate.fitted.cost,
        "gained": _gain(candidate.gained),
    }


def _map(entry: ResidualMap) -> Entry:
    return {**vars(entry), "telling": entry.telling}
