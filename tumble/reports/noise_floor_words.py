"""Whether there is anything to explain, in plain words."""

from estimator.diagnosis.noise_floor import NoiseFloor
from estimator.measurements.silhouettes.noise_floor import OWN_TOO_LARGE
from estimator.reports.misfit_words import p_words


def floor_sentence(floor: NoiseFloor, unit: str, at: tuple[float, float]) -> str:
    """The finding of a campaign whose residuals are in ``unit``; ``at``: p-value of all effects' tests, corrected, and its level."""
    interval = f"reduced chi-square {floor.reduced:.2f}, 95%: {floor.interval[0]:.2f} to {floor.interval[1]:.2f}"
    if unit != "px":
        said = (
            f"The residuals are {floor.rms_px:.2f} times the noise that each sequence shows; noise that is new in every row or frame "
            f"makes {floor.floor_px:.2f} of that ({interval}; noise alone: 1 or less)."
        )
        excess = f"{floor.excess_px:.2f} times the noise, alike in neighbouring rows or frames"
        if floor.rms_px < 1.0:
            excess = (
                f"{floor.excess_px:.2f} of those {floor.rms_px:.2f} is alike in neighbouring rows or frames, as noise that is new is not"
            )
        return _concluded(floor, said, excess, at)
    said = (
        f"The residuals are {floor.rms_px:.3f} px RMS; noise that changes with every frame makes {floor.repeated_px:.3f} px of that "
        f"({interval}; up to {floor.allowed:.2f} may come of the calibrated views and of hulls that are not quite the body)."
    )
    if floor.jumps:
        return (
            f"{said} Whole frames jump: outlines alone would change by {OWN_TOO_LARGE * floor.neighbours_px:.3f} px. "
            "Something acts on frames one by one, like a trigger that jitters."
        )
    return _concluded(floor, said, f"{floor.excess_px:.3f} px, alike in neighbouring frames", at)


def _concluded(floor: NoiseFloor, said: str, excess: str, at: tuple[float, float]) -> str:
    """What was ``said`` with its conclusion: by the size of the ``excess``, or by p-value and level ``at``."""
    p_missing, alpha = at
    if floor.beyond:
        return f"{said} There is something to explain: about {excess}."
    if p_missing < alpha:
        return f"{said} Their pattern is not that of noise ({p_words(p_missing)}): there is something to explain."
    return f"{said} By their size, and by a test of each effect alone, there is nothing to explain."
