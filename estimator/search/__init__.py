"""From pictures to flights that are near the right one: tracks, starts, rivals."""
