"""Pictures of flat targets -> cameras: corners, starts, bundle adjustment, covariance, and whether the covariance is honest."""
