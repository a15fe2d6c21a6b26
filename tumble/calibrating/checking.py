"""``tumble calibrate check``: further pictures of a board against a calibration."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from datasets.errors import InputError
from datasets.vocabulary.board import board_of
from datasets.vocabulary.calibration import Calibration
from estimator.calibration.checking import Agreement, agreement
from estimator.calibration.fitting import RigFit
from tumble.calibrating.gravity import calibration_of, paired
from tumble.calibrating.pictures import sightings_of


@dataclass(frozen=True)
class Checked:
    """A calibration, how pictures agree with it (``None``: no pictures were given), and the pictures as seen with its cameras held."""

    calibration: Calibration
    agreement: Agreement | None
    fit: RigFit | None

    @property
    def good(self) -> bool:
        """Whether nothing speaks against it: the pictures where there are some, else its own check by halves."""
        if self.agreement is not None:
            return self.agreement.test.honest
        own = None if self.calibration.fit is None else self.calibration.fit.cross_validation
        return own is None or own.honest

    @property
    def rows(self) -> dict[str, str]:
        """Figures for the screen and the page."""
        if self.agreement is None:
            return {}
        test = self.agreement.test
        said = "the pictures agree with it" if test.honest else "the pictures contradict it"
        return {
            "RMS residual, cameras as calibrated": f"{self.agreement.held_px:.4f} px",
            "RMS residual, cameras fitted to these pictures": f"{self.agreement.free_px:.4f} px",
            "calibration and its covariance against these pictures": (
                f"{said}: chi-square {test.chi_square:.1f} for {test.degrees_of_freedom}, p = {test.p_value:.2g}"
            ),
        }


def check_calibration(path: Path, pictures: Sequence[Path], board: str | None) -> Checked:
    """Read a calibration and compare pictures with it.

    Raises
    ------
    InputError
        Naming the file, what was expected and what came.
    """
    known = calibration_of(path)
    if not pictures:
        return Checked(known, None, None)
    words = board or known.board
    if words is None:
        raise InputError(f"{path}: expected a calibration that names its board, got one without; state --board.")
    shape = board_of(words)
    pairs = paired(pictures, known.cameras, "a folder, stack or film")
    sightings = tuple(s for c, targets in pairs for s in sightings_of(targets, shape, c)[0])
    try:
        found, held, bundle = agreement(sightings, shape, known.cameras, known.covariance)
    except (InputError, np.linalg.LinAlgError) as error:
        raise InputError(f"{pictures[0]}: {error}") from None
    return Checked(known, found, RigFit(held, bundle, np.zeros((0, 0)), 0, True))
