"""What can be said of a recording and of calibrated views before anything is fitted."""

from estimator.readiness.look import Look, look_at

__all__ = ["Look", "look_at"]
