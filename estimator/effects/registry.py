"""Every effect the estimator has a model of, by key; one line each."""

from estimator.effects.catalogue.body.centre_of_mass import CentreOfMass
from estimator.effects.catalogue.body.inertia_ratios import InertiaRatios
from estimator.effects.catalogue.body.length_scale import LengthScale
from estimator.effects.catalogue.body.products_of_inertia import ProductsOfInertia
from estimator.effects.catalogue.clock.clock_offset import ClockOffset
from estimator.effects.catalogue.clock.dropped_frames import DroppedFrames
from estimator.effects.catalogue.clock.frame_rate import FrameRate
from estimator.effects.catalogue.clock.stamp_scatter import StampScatter
from estimator.effects.catalogue.clock.trigger_jitter import TriggerJitter
from estimator.effects.catalogue.dynamics.gravity import Gravity
from estimator.effects.catalogue.dynamics.induced_drag import InducedDrag
from estimator.effects.catalogue.dynamics.linear_drag import LinearDrag
from estimator.effects.catalogue.dynamics.magnus_lift import MagnusLift
from estimator.effects.catalogue.dynamics.nutation_damping import NutationDamping
from estimator.effects.catalogue.dynamics.quadratic_drag import QuadraticDrag
from estimator.effects.catalogue.dynamics.saturating_lift import SaturatingLift
from estimator.effects.catalogue.dynamics.spin_damping import SpinDamping
from estimator.effects.catalogue.dynamics.steady_wind import SteadyWind
from estimator.effects.catalogue.dynamics.uniform_acceleration import UniformAcceleration
from estimator.effects.catalogue.dynamics.unmeasured_drag import UnmeasuredDrag
from estimator.effects.catalogue.dynamics.unmeasured_lift import UnmeasuredLift
from estimator.effects.catalogue.exposure.motion_blur_threshold import MotionBlurThreshold
from estimator.effects.catalogue.exposure.rolling_shutter import RollingShutter
from estimator.effects.catalogue.gyroscope.gyroscope_bias import GyroscopeBias
from estimator.effects.catalogue.gyroscope.gyroscope_scale import GyroscopeScale
from estimator.effects.catalogue.optics.camera_vibration import CameraVibration
from estimator.effects.catalogue.optics.defocus_growth import DefocusGrowth
from estimator.effects.catalogue.optics.focal_length import FocalLength
from estimator.effects.catalogue.optics.pixel_aspect import PixelAspect
from estimator.effects.catalogue.optics.principal_point import PrincipalPoint
from estimator.effects.catalogue.optics.radial_distortion import RadialDistortion
from estimator.effects.catalogue.optics.tangential_distortion import TangentialDistortion
from estimator.effects.catalogue.segmentation.blooming import Blooming
from estimator.effects.catalogue.segmentation.outline_offset import OutlineOffset
from estimator.effects.catalogue.segmentation.rim_light_leak import RimLightLeak
from estimator.effects.catalogue.segmentation.view_outline_offset import ViewOutlineOffset
from estimator.effects.catalogue.tracking.perspective import Perspective
from estimator.effects.catalogue.tracking.position_distortion import PositionDistortion
from estimator.effects.link import EffectModel

MODELS: dict[str, EffectModel] = {
    model.entry.key: model
    for model in (
        FrameRate(),
        DroppedFrames(),
        TriggerJitter(),
        StampScatter(),
        ClockOffset(),
        CentreOfMass(),
        InertiaRatios(),
        ProductsOfInertia(),
        LengthScale(),
        ViewOutlineOffset(),
        Gravity(),
        UniformAcceleration(),
        LinearDrag(),
        QuadraticDrag(),
        MagnusLift(),
        SaturatingLift(),
        InducedDrag(),
        UnmeasuredLift(),
        UnmeasuredDrag(),
        SteadyWind(),
        SpinDamping(),
        NutationDamping(),
        RadialDistortion(),
        TangentialDistortion(),
        PrincipalPoint(),
        PixelAspect(),
        FocalLength(),
        CameraVibration(),
        DefocusGrowth(),
        MotionBlurThreshold(),
        RollingShutter(),
        OutlineOffset(),
        Blooming(),
        RimLightLeak(),
        PositionDistortion(),
        Perspective(),
        GyroscopeBias(),
        GyroscopeScale(),
    )
}
