"""Families that stand for an effect nobody has named yet, and the laws that are read off them."""

from estimator.effects.empirical.families import (
    BodyOutline,
    BodyThrust,
    ForceField,
    ImageWarp,
    SmoothForce,
    SmoothTimeShift,
    SmoothTorque,
    ZoomInTime,
)

__all__ = ["BodyOutline", "BodyThrust", "ForceField", "ImageWarp", "SmoothForce", "SmoothTimeShift", "SmoothTorque", "ZoomInTime"]
