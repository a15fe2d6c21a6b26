"""From the outlines that the cameras recorded to the silhouettes that are used."""

import numpy as np

from datasets.estimate import Status
from datasets.observation import Frames, Observation
from estimator.data.configuration import Configuration
from estimator.data.fit_task import Sightings
from estimator.data.no_measurement import NoMeasurement
from estimator.geometry.silhouettes import silhouettes
from estimator.outlines.behind_plate import beside_plate
from estimator.outlines.pictures.pictured import Pictures
from estimator.outlines.recording import outlines_of
from estimator.outlines.result import FrameStatus, OutlineTrack


def tracks_of(observation: Observation) -> tuple[OutlineTrack, ...]:
    """The outlines that each high-speed camera recorded, without frames of which a plate hides a part."""
    tracks = (
        outlines_of(r, c.intrinsics, name=f"{observation.name}, camera {c.name}")
        for r, c in zip(observation.recordings, observation.cameras, strict=True)
    )
    return tuple(beside_plate(track, observation, number) for number, track in enumerate(tracks))


def bias_pairs(observation: Observation, configuration: Configuration) -> int:
    """Pairs of draws from which the outlines' bias is predicted; 0 where some come from pictures and some were given as such."""
    pictured = {isinstance(recording, Frames) for recording in observation.recordings}
    return configuration.bias_pairs if len(pictured) == 1 else 0


def pictures_of(observation: Observation, tracks: tuple[OutlineTrack, ...], sightings: Sightings) -> Pictures | None:
    """How the sightings' pictures show outlines; none where outlines were given as such by any camera."""
    if not all(isinstance(recording, Frames) for recording in observation.recordings):
        return None
    return Pictures.of([tracks[int(c)].frames[int(f)] for c, f in zip(sightings.camera, sightings.frame, strict=True)])


def usable_sightings(
    observation: Observation, tracks: tuple[OutlineTrack, ...], configuration: Configuration, *, in_part: bool = False
) -> Sightings:
    """The silhouettes of all cameras that are used, in the order of time within each camera; ``in_part``: those too that are used in part.

    Raises
    ------
    NoMeasurement
        Where there are fewer than the configuration asks for.
    """
    places = [(c, int(f)) for c, t in enumerate(tracks) for f in np.flatnonzero(t.seen if in_part else t.used)]
    shown = [tracks[c].frames[f] for c, f in places]
    cameras = [observation.cameras[c].intrinsics for c, _ in places]
    hulls = silhouettes([s.outline for s in shown], cameras, unsure=[s.unsure for s in shown]) if places else None
    usable = np.flatnonzero(np.diff(hulls.offsets) > 0) if hulls is not None else np.zeros(0, dtype=np.int64)
    whole = sum(shown[i].used for i in usable)
    if hulls is None or whole < configuration.minimum_frames:
        raise _too_few(tracks, whole, configuration.minimum_frames)
    camera = np.array([places[i][0] for i in usable], dtype=np.int64)
    frame = np.array([places[i][1] for i in usable], dtype=np.int64)
    outlines, unsure = tuple(shown[i].outline.points_px for i in usable), tuple(shown[i].unsure for i in usable)
    times = np.array([observation.clock_of(int(c)).times_s[f] for c, f in zip(camera, frame, strict=True)])
    return Sightings(hulls.take(usable.tolist()), camera, frame, times, observation.cameras, outlines, unsure)


def _too_few(tracks: tuple[OutlineTrack, ...], usable: int, wanted: int) -> NoMeasurement:
    reasons = [r for t in tracks for r, u in zip(t.reasons, t.used, strict=True) if not u]
    counts = ", ".join(f"{reasons.count(r)} {r}" for r in dict.fromkeys(reasons))
    outside = sum(r in {str(FrameStatus.CUT_OFF), str(FrameStatus.ABSENT)} for r in reasons)
    status = Status.OUT_OF_VIEW if outside > 0.5 * sum(len(t) for t in tracks) else Status.NOT_ENOUGH_FRAMES
    return NoMeasurement(status, f"{usable} usable pictures, at least {wanted} are needed" + (f"; left out: {counts}." if counts else "."))
