"""All studies, in the order in which they are run and listed."""

from studies.pages import figure_4, figure_5

STUDIES = (figure_4.STUDY, figure_5.STUDY)
