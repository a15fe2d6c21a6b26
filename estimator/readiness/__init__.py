"""What can be said of a recording and of calibrated views before anything is fitted."""

from estimator.readiness.fall import Fall, fall_of
from estimator.readiness.inspection import Inspection, inspect_recording
from estimator.readiness.promise import Promise, depth_of, promise_of

__all__ = ["Fall", "Inspection", "Promise", "depth_of", "fall_of", "inspect_recording", "promise_of"]
