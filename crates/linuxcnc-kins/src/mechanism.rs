//! What a mechanism must say to be a LinuxCNC module, and the mechanisms that have nothing to switch.

use pkm_kins::*;

/// The machines that ship: name and geometry.
pub type Shipped<P> = &'static [(&'static str, fn() -> P)];

/// A mechanism as a LinuxCNC module.
pub trait Mechanism: Sized {
    /// Its geometry.
    type Parameters: Named + Copy + 'static;
    /// First part of its HAL names.
    const PREFIX: &'static str;
    /// True if the pose or a joint has angles: LinuxCNC has degrees, the kinematics radians.
    const DEGREES: bool;
    /// Bit i: joint i is an angle.
    const ROTARY_JOINTS: u32 = 0;
    /// What `motion.switchkins-type` may be, from 0; 1: nothing to switch.
    const TYPES: i32 = 1;
    /// True if [`Self::forward`] iterates: the module then has the pins `last-iterations` and `max-iterations`.
    const ITERATES: bool = false;
    /// The machines that ship, for `loadrt moma_kins machine=moma-a`. At least one.
    const SHIPPED: Shipped<Self::Parameters>;

    /// The mechanism with this geometry, in the state that `before` is in.
    ///
    /// # Errors
    /// The geometry makes no mechanism.
    fn new(parameters: &Self::Parameters, before: Option<&Self>) -> Result<Self, GeometryError>;

    /// Pose → joints; after an error nothing is written.
    ///
    /// # Errors
    /// As [`Kinematics::inverse`].
    fn inverse(&mut self, pose: &Pose, joints: &mut Joints) -> Result<(), InverseError>;

    /// Joints → pose, which holds the seed; after an error it still does. Counts its iterations.
    ///
    /// # Errors
    /// As [`Kinematics::forward`].
    fn forward(&mut self, joints: &Joints, pose: &mut Pose, iterations: &mut u32)
    -> Result<(), ForwardError>;

    /// `motion.switchkins-type` has become `to`.
    ///
    /// # Errors
    /// See [`SwitchError`]; the mechanism is as it was.
    fn switch(&mut self, to: i32) -> Result<(), SwitchError> {
        if to == 0 { Ok(()) } else { Err(SwitchError::NoSuchType) }
    }
}

/// Why the kinematics cannot be switched now.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum SwitchError {
    /// The mechanism has no such type.
    NoSuchType,
    /// The machine is moving.
    Moving,
    /// The joints stand where the new kinematics has no pose.
    State(ForwardError),
}

/// A mechanism without state of its own.
macro_rules! plain {
    ($kind:ty, $parameters:ty, $prefix:literal, degrees $degrees:literal, joints $rotary:literal, $($name:literal => $value:expr),+) => {
        impl Mechanism for $kind {
            type Parameters = $parameters;
            const PREFIX: &'static str = $prefix;
            const DEGREES: bool = $degrees;
            const ROTARY_JOINTS: u32 = $rotary;
            const SHIPPED: Shipped<$parameters> = &[$(($name, || $value)),+];

            fn new(parameters: &$parameters, _: Option<&Self>) -> Result<Self, GeometryError> {
                <$kind>::new(parameters)
            }

            #[inline(always)]
            fn inverse(&mut self, pose: &Pose, joints: &mut Joints) -> Result<(), InverseError> {
                self.inverse_into(pose, joints)
            }

            #[inline(always)]
            fn forward(&mut self, joints: &Joints, pose: &mut Pose, _: &mut u32) -> Result<(), ForwardError> {
                self.forward_into(joints, pose)
            }
        }
    };
}

plain!(Moma, MomaParameters, "moma", degrees false, joints 0,
    "moma-a" => MomaConfiguration::A.into(), "moma-b" => MomaConfiguration::B.into(),
    "moma-c" => MomaConfiguration::C.into(), "moma-d" => MomaConfiguration::D.into());

plain!(Moma4s, Moma4sParameters, "moma-4s", degrees false, joints 0,
    "moma-4s-p" => Moma4sConfiguration::P.into(), "moma-4s-s5" => Moma4sConfiguration::S5.into(),
    "moma-4s-s10" => Moma4sConfiguration::S10.into(), "moma-4s-u5" => Moma4sConfiguration::U5.into(),
    "moma-4s-u10" => Moma4sConfiguration::U10.into());

plain!(MomaW, MomaWParameters, "moma-w", degrees false, joints 0, "moma-w" => MomaWParameters::default());

plain!(HvMill, HvMillParameters, "hv-mill", degrees true, joints 0b1_1000,
    "hv-mill-h3" => HvMillParameters::h(3), "hv-mill-h4" => HvMillParameters::h(4),
    "hv-mill-v3" => HvMillParameters::v(3), "hv-mill-v4" => HvMillParameters::v(4),
    "hv-mill-v5" => HvMillParameters::v(5));

plain!(Planar, PlanarParameters, "planar", degrees false, joints 0, "moma-a" => {
    let moma = MomaParameters::from(MomaConfiguration::A);
    PlanarParameters {
        reference_mm: moma.reference_mm,
        guide_angle_deg: moma.guide_angle_deg,
        l_mm: moma.l_mm,
        offset_mm: [[0.0; 2]; 2],
        working_mode: moma.working_mode,
        assembly: moma.assembly,
        one_sided: moma.one_sided,
    }
});

plain!(LinearDelta, LinearDeltaParameters, "linear-delta", degrees false, joints 0,
    "default" => LinearDeltaParameters { joint_radius_mm: 140.0, joint_length_mm: 270.0 });

plain!(Hexapod, HexapodParameters, "hexapod", degrees true, joints 0,
    "default" => HexapodParameters::symmetric(300.0, 0.4, 150.0, 0.4, 400.0));

/// The only one that iterates: Newton, counted as genhexkins counts its own.
impl Mechanism for Lambda6 {
    type Parameters = Lambda6Parameters;
    const PREFIX: &'static str = "lambda";
    const DEGREES: bool = true;
    const ITERATES: bool = true;
    const SHIPPED: Shipped<Lambda6Parameters> =
        &[("lambda6", || Lambda6Set::Yaw45.into()), ("lambda6-paper", || Lambda6Set::Paper.into())];

    fn new(parameters: &Lambda6Parameters, _: Option<&Self>) -> Result<Self, GeometryError> {
        Lambda6::new(parameters)
    }

    #[inline(always)]
    fn inverse(&mut self, pose: &Pose, joints: &mut Joints) -> Result<(), InverseError> {
        self.inverse_into(pose, joints)
    }

    #[inline(always)]
    fn forward(
        &mut self,
        joints: &Joints,
        pose: &mut Pose,
        iterations: &mut u32,
    ) -> Result<(), ForwardError> {
        *pose = self.forward_counting(joints, pose, iterations)?;
        Ok(())
    }
}
