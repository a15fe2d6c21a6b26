"""Every effect the estimator has a model of, by key; one line each."""

from estimator.effects.blooming import Blooming
from estimator.effects.camera_vibration import CameraVibration
from estimator.effects.centre_of_mass import CentreOfMass
from estimator.effects.defocus_growth import DefocusGrowth
from estimator.effects.dropped_frames import DroppedFrames
from estimator.effects.focal_length import FocalLength
from estimator.effects.frame_rate import FrameRate
from estimator.effects.gravity import Gravity
from estimator.effects.gyroscope_bias import GyroscopeBias
from estimator.effects.gyroscope_scale import GyroscopeScale
from estimator.effects.inertia_ratios import InertiaRatios
from estimator.effects.length_scale import LengthScale
from estimator.effects.linear_drag import LinearDrag
from estimator.effects.link import EffectModel
from estimator.effects.magnus_lift import MagnusLift
from estimator.effects.motion_blur_threshold import MotionBlurThreshold
from estimator.effects.outline_offset import OutlineOffset
from estimator.effects.pixel_aspect import PixelAspect
from estimator.effects.position_distortion import PositionDistortion
from estimator.effects.principal_point import PrincipalPoint
from estimator.effects.quadratic_drag import QuadraticDrag
from estimator.effects.radial_distortion import RadialDistortion
from estimator.effects.rim_light_leak import RimLightLeak
from estimator.effects.rolling_shutter import RollingShutter
from estimator.effects.saturating_lift import SaturatingLift
from estimator.effects.spin_damping import SpinDamping
from estimator.effects.steady_wind import SteadyWind
from estimator.effects.tangential_distortion import TangentialDistortion
from estimator.effects.trigger_jitter import TriggerJitter
from estimator.effects.uniform_acceleration import UniformAcceleration
from estimator.effects.unmeasured_lift import UnmeasuredLift
from estimator.effects.view_outline_offset import ViewOutlineOffset

MODELS: dict[str, EffectModel] = {
    model.entry.key: model
    for model in (
        FrameRate(),
        DroppedFrames(),
        TriggerJitter(),
        CentreOfMass(),
        InertiaRatios(),
        LengthScale(),
        ViewOutlineOffset(),
        Gravity(),
        UniformAcceleration(),
        LinearDrag(),
        QuadraticDrag(),
        MagnusLift(),
        SaturatingLift(),
        UnmeasuredLift(),
        SteadyWind(),
        SpinDamping(),
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
        GyroscopeBias(),
        GyroscopeScale(),
    )
}
