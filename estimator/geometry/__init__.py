"""Mathematics of outlines and hulls: epipolar tangency error, tangent hull, visual hull, what outlines recede by."""
