"""The reason why there is no measurement, as an exception that carries a status."""

from datasets.estimate import Status

RAN_AWAY = "no flight fits the outlines: every fit ran away to spins that no particle has."


class NoMeasurement(Exception):
    """A step could not go on; carries the status and a sentence for the user."""

    def __init__(self, status: Status, message: str) -> None:
        super().__init__(message)
        self.status = status
        self.message = message
