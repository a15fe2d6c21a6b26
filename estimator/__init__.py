"""The instrument: silhouettes, epipolar tangency error, rigid-body Levenberg-Marquardt, uncertainty. Reads observations only."""
