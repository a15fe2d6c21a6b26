"""Outlines sample by sample through a lens that is stated to distort."""

from dataclasses import replace

import numpy as np

from estimator.measurements.outlines.task import outline_errors, placed_at, with_contacts_at
from tests.estimator.measurements.outlines import sampled_campaign


def test_a_lens_that_is_stated_to_distort_shows_the_same_body() -> None:
    """Samples are as far off but for how much a pixel is, though distortion moves outlines by several pixels."""
    found = sampled_campaign.registered()
    task, flight, model = found.campaign.sequences[0], found.start.flights[0], found.campaign.kind.base
    sightings, theta = task.task.sightings, task.contacts.amplitude
    (camera,) = sightings.cameras
    lens = replace(camera.intrinsics, distortion=(-3.0, 0.0, 0.002, -0.001, 0.0))
    bent = tuple(lens.distort(camera.intrinsics.normalise(outline)) for outline in sightings.outlines_px)
    assert max(np.abs(now - then).max() for now, then in zip(bent, sightings.outlines_px, strict=True)) > 1.0
    seen = replace(sightings, cameras=(replace(camera, intrinsics=lens),), outlines_px=bent)
    distorting = replace(task, task=replace(task.task, sightings=seen))
    met = (with_contacts_at(each, placed_at(each, flight, model, theta), model, theta) for each in (task, distorting))
    plain, distorted = (outline_errors(each, flight, model, theta) for each in met)
    assert np.sqrt(np.mean((distorted.met.gaps - plain.met.gaps) ** 2)) < 0.1 * np.sqrt(np.mean(plain.met.gaps**2))
