"""What can be said of a recording and of calibrated views before anything is fitted."""

from estimator.readiness.fall import Fall, fall_of, wobble_of
from estimator.readiness.look import Look, look_at
from estimator.readiness.promise import Promise, depth_of, promise_of

__all__ = ["Fall", "Look", "Promise", "depth_of", "fall_of", "look_at", "promise_of", "wobble_of"]
