"""All studies, in the order in which they are run and listed."""

from studies.pages import accuracy, depth, factorial, figure_4, figure_5, frame_step, optics, surface_fit, two_cameras

STUDIES = (
    accuracy.STUDY,
    figure_4.STUDY,
    figure_5.STUDY,
    factorial.STUDY,
    depth.STUDY,
    two_cameras.STUDY,
    frame_step.STUDY,
    optics.STUDY,
    surface_fit.STUDY,
)
