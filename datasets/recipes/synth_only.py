"""Effects that nature can be told to have and that no instrument knows: for trying out what happens outside the catalogue.

Declared as the catalogue's are (:mod:`datasets.vocabulary.effects`), but here, where the estimator does not look.
"""

from datasets.vocabulary.effects import EffectEntry, Parameter, Scope, Stage

_ENTRIES = (
    EffectEntry(
        "wall_attraction",
        Stage.DYNAMICS,
        Scope.CAMPAIGN,
        (
            Parameter("strength", "m3/s2", (1e-5, 1e-2), 1e-5, "acceleration times distance squared"),
            Parameter("normal_x", "1", (-1.0, 1.0), 1e-3, "direction from the wall into the room, world frame, along x; of any length"),
            Parameter("normal_y", "1", (-1.0, 1.0), 1e-3, "the same along y"),
            Parameter("normal_z", "1", (-1.0, 1.0), 1e-3, "the same along z"),
            Parameter("position", "m", (-1.0, 1.0), 1e-3, "where the wall lies: n . x = position, n the unit normal"),
        ),
        "dv/dt = g - strength n / (n . x - position)2",
        "Israelachvili, Intermolecular and Surface Forces (2011), ch. 13; image charges before a conducting wall follow the same power",
        searched=("normal_x", "normal_y", "normal_z", "position"),
    ),
    EffectEntry(
        "outgassing_thrust",
        Stage.DYNAMICS,
        Scope.PARTICLE,
        (
            *(Parameter(f"a{i}", "m/s2", (-5.0, 5.0), 1e-3, f"thrust over mass along body axis {i}") for i in (1, 2, 3)),
            *(Parameter(f"arm{i}", "m", (-3e-3, 3e-3), 1e-6, f"the vent's place from the centre of mass, axis {i}") for i in (1, 2, 3)),
        ),
        "dv/dt = g + R_world_body a; torque = m arm x a, body frame",
        "Marsden, Sekanina and Yeomans, Astron. J. 78 (1973) 211: thrust of outgassing comets",
        searched=("arm1", "arm2", "arm3"),
    ),
    EffectEntry(
        "thermal_focus_drift",
        Stage.OPTICS,
        Scope.CAMERA,
        (
            Parameter("relative", "1", (-0.1, 0.1), 1e-4, "change of focal length in the end, over the stated one"),
            Parameter("time_constant", "s", (1e-3, 10.0), 1e-4, "time in which it comes within 1/e of the end"),
        ),
        "focal length f (1 + relative (1 - exp(-t / time_constant))), t the time stamp counted from the sequence's first frame",
        "Smith, Clarke and Robson, ISPRS Archives 37-B5 (2008): cameras warming up",
        searched=("time_constant",),
    ),
)

SYNTH_ONLY: dict[str, EffectEntry] = {entry.key: entry for entry in _ENTRIES}
"""The effects by key."""
