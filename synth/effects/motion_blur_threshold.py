"""The outline of a picture that moved during its exposure, drawn at another level than the half.

The silhouettes of many instants of the exposure are averaged, and the outline is drawn where the darkness is ``0.5 - bias``. Where the
outline moves at a steady ``w`` px/s this comes to ``delta = bias |u . w| T``. Valid for ``|bias| < 0.5``.
"""

from datasets.errors import InputError
from synth.effects.links import Values


def level(values: Values) -> float:
    """The level of darkness at which the outline is drawn.

    Raises
    ------
    InputError
        Where there is no outline at such a level.
    """
    if not abs(values["bias"]) < 0.5:
        raise InputError(f"motion_blur_threshold: expected a bias between -0.5 and 0.5, got {values['bias']:g}.")
    return 0.5 - values["bias"]
