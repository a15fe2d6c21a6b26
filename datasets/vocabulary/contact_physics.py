"""What may be true of a contact besides constant restitution and rigid Coulomb friction on a known plate: names, parameters, meaning.

Said once for everybody, as the catalogue of effects is (:mod:`datasets.vocabulary.effects`): ``synth`` realises an entry in its compliant
contact, an instrument may look for it in any way it likes. A parameter of 0 is "no such physics".
"""

from datasets.vocabulary.effects import EffectEntry, Parameter, Scope, Stage

_ENTRIES = (
    EffectEntry(
        "velocity_dependent_restitution",
        Stage.CONTACT,
        Scope.CAMPAIGN,
        (Parameter("yield_speed", "m/s", (0.05, 5.0), 1e-2, "speed of a central impact above which the contact flows"),),
        "Stronge's coefficient e (W / W_yield)^(-1/8), W the work of compression of a corner, where it exceeds "
        "W_yield = m yield_speed^2 / 2: e falls with the fourth root of the speed",
        "Johnson, Contact Mechanics (1985), eq. 11.47",
    ),
    EffectEntry(
        "adhesion",
        Stage.CONTACT,
        Scope.CAMPAIGN,
        (
            Parameter("pull_off", "N", (0.0, 5.0), 1e-3, "largest attraction of a corner that parts"),
            Parameter("reach", "m", (1e-7, 1e-4), 1e-7, "way over which it is drawn before it lets go"),
        ),
        "a corner that parts is held back by 4 pull_off (s / reach) (1 - s / reach) on its way s, which costs 2/3 pull_off reach",
        "Johnson, Kendall and Roberts, Proc. R. Soc. A 324 (1971) 301: pull-off; Thornton and Ning, Powder Technol. 99 (1998) 154",
        searched=("reach",),
    ),
    EffectEntry(
        "tangential_compliance",
        Stage.CONTACT,
        Scope.CAMPAIGN,
        (Parameter("ratio", "1", (0.1, 10.0), 1e-2, "tangential stiffness over Mindlin's"),),
        "before it slips a corner is held by a spring of stiffness ratio 8 G* sqrt(R overlap)",
        "Mindlin, J. Appl. Mech. 16 (1949) 259; Maw, Barber and Fawcett, Wear 38 (1976) 101",
    ),
    EffectEntry(
        "plate_tilt",
        Stage.CONTACT,
        Scope.CAMPAIGN,
        (
            Parameter("angle", "rad", (-0.1, 0.1), 1e-3, "turn of the true plate against the nominal one about the viewing direction"),
            Parameter("angle_across", "rad", (-0.1, 0.1), 1e-3, "turn about the line of the plate that lies across the viewing direction"),
        ),
        "the plate stands otherwise than whoever measured it believes; the plate that is stated is the nominal one",
        "Guide to the Expression of Uncertainty in Measurement (2008), 3.2: a systematic effect that was not corrected",
    ),
    EffectEntry(
        "yielding_plate",
        Stage.CONTACT,
        Scope.CAMPAIGN,
        (Parameter("inverse_mass", "1/kg", (0.0, 1e4), 1.0, "one over the mass of the plate that moves with the contact"),),
        "the plate recoils along its normal as a free mass during an impact, and is at rest again at the next",
        "Zener, Phys. Rev. 59 (1941) 669: energy that a plate takes away",
    ),
    EffectEntry(
        "chip",
        Stage.CONTACT,
        Scope.CAMPAIGN,
        (Parameter("depth", "1", (0.0, 0.3), 1e-2, "depth of the lost corner over its distance from the centre of mass"),),
        "at the end of the first impact the corner that touched breaks off at a plane across its direction and leaves as fast as it is",
        "Rozenblat et al., Chem. Eng. Sci. 71 (2012) 366: breakage of single particles by impact",
    ),
)

CONTACT_PHYSICS: dict[str, EffectEntry] = {entry.key: entry for entry in _ENTRIES}
"""The entries by key."""
