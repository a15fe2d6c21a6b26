"""The motion of a rigid body: rotations, free flight, flights that meet at impacts, with derivatives."""
