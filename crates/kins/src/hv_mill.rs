//! MOMA HV-Mill: a horizontal (H) and a vertical (V) MOMA 4S, one table carriage, one rotary table, optionally a tilting
//! tool head on V; one mechanism is active at a time.
//!
//! Source: \[HV\] G. Vasilić, S. Živanović, M. Milutinović, Z. Dimić, "Kinematika kompleksne višeosne i viševretene mašine
//! alatke namenjene za proces obrade glodanjem".
//! Frame: workpiece {W}, axes of {B_j} of the mechanism j (+z from workpiece to spindle, ISO 841), mm and rad.
//! [`HvMill`] (one mechanism): X Y Z, table B (H) or C (V), head B (V). Joints p1 p2 p3 p4 (p5 on V).
//! [`HvMachine`](crate::HvMachine) (figs 2a, 2b): H: X Y Z B; V: U V W C and B for the head. Joints H1 H2 V1 V2 carriage table (head).
//!
//! | here          | \[HV\]        | meaning                                                        |
//! |---------------|-------------|----------------------------------------------------------------|
//! | `cr_mm`       | CR1         | centre of the rotary table at p3 = p4 = 0, in {B_j}            |
//! | `w0_mm`       | ᶜᴿ¹p_W      | origin of {W} relative to CR1 at p4 = 0                        |
//! | `table_sense` | –           | s_θ = ±1; +1 is eq (10) literally, −1 is ISO 841's             |
//! | `c_mm`        | CR2         | centre of the head relative to the platform's point P          |
//! | `head_sense`  | –           | s_b = ±1                                                       |
//! | τ3            | –           | constant third coordinate of the tip                           |
//!
//! T_rot: \[HV\] (1), (2), correct as printed. V: (x, y, z) = (q1, −q3, q2); H: (x, y, z) = (−q1, q2, −q3).
//! Inverse: ΔT = (R_θ − 1) A − (R_b − 1) r_t is added to the *translational* coordinates before the inverse of the
//!   parallel mechanism. Corrected: \[HV\] (11) adds ΔT to joints; (10) describes two axes that both carry the workpiece,
//!   which is not the machine of fig 2b (see [`delta_t_workpiece`] for that chain).
//! Singular: exactly where the active MOMA 4S is.
//! Accuracy: as [`Planar`](crate::planar::Planar).

use crate::errors::{self, ForwardError, GeometryError, InverseError, Key};
use crate::kinematics::{
    Branches, Jacobian, JointKind, JointMotion, Joints, Kinematics, MAX_JOINTS, Singularity,
};
use crate::maths::sincos;
use crate::moma_4s::{Moma4s, Moma4sConfiguration, Moma4sParameters};
use crate::planar::Vec2;
use crate::pose::{Axis, AxisSet, Pose};
use crate::vector::{Vec3, add, is_finite, scale, sub};

/// Which of the two mechanisms.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Deserialize, serde::Serialize))]
pub enum Spindle {
    /// Horizontal, `'` in \[HV\]: third axis z, table about y.
    #[cfg_attr(feature = "serde", serde(alias = "h"))]
    H,
    /// Vertical, `''` in \[HV\]: third axis y, table about z, head about y.
    #[cfg_attr(feature = "serde", serde(alias = "v"))]
    V,
}

impl Spindle {
    /// {Q} → {B_j}: \[HV\] (1) for V, (2) for H.
    pub const fn from_q(self, [q1, q2, q3]: Vec3) -> Vec3 {
        match self {
            Self::V => [q1, -q3, q2],
            Self::H => [-q1, q2, -q3],
        }
    }

    /// {B_j} → {Q}: the transpose.
    pub const fn to_q(self, [x, y, z]: Vec3) -> Vec3 {
        match self {
            Self::V => [x, z, -y],
            Self::H => [-x, y, -z],
        }
    }

    /// In-plane coordinates (q1, q2) and third coordinate (along u3) of a vector in {B_j}.
    #[inline]
    fn split(self, [x, y, z]: Vec3) -> (Vec2, f64) {
        match self {
            Self::V => ([x, z], y),
            Self::H => ([-x, y], z),
        }
    }

    /// The inverse of [`Self::split`].
    #[inline]
    fn join(self, [q1, q2]: Vec2, third: f64) -> Vec3 {
        match self {
            Self::V => [q1, third, q2],
            Self::H => [-q1, q2, third],
        }
    }

    /// The table's axis: H y, V z.
    const fn table(self) -> Turn {
        match self {
            Self::H => Turn::Y,
            Self::V => Turn::Z,
        }
    }
}

/// A coordinate axis to turn about.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum Turn {
    X,
    Y,
    Z,
}

impl Turn {
    /// Rot(axis, angle) v, with the angle's sine and cosine.
    #[inline]
    fn rotate(self, (s, c): (f64, f64), [x, y, z]: Vec3) -> Vec3 {
        match self {
            Self::X => [x, c * y - s * z, s * y + c * z],
            Self::Y => [c * x + s * z, y, c * z - s * x],
            Self::Z => [c * x - s * y, s * x + c * y, z],
        }
    }

    /// axis × v
    #[inline]
    fn cross(self, [x, y, z]: Vec3) -> Vec3 {
        match self {
            Self::X => [0.0, -z, y],
            Self::Y => [z, 0.0, -x],
            Self::Z => [-y, x, 0.0],
        }
    }
}

/// ΔT for a chain in which **both** rotary axes carry the workpiece, axis 1 sitting on axis 2: \[HV\] (10) literally,
/// (T₂T₁ − 1) A + (T₂ − 1) C with C = ᶜᴿ²p_CR1. Not the machine of fig 2b, whose second axis turns the tool.
/// Lengths mm, angles rad; `a` = ᶜᴿ¹p_W + ᵂp_T.
pub fn delta_t_workpiece(first: (Turn, f64), second: (Turn, f64), a: Vec3, c: Vec3) -> Vec3 {
    let turned = add(first.0.rotate(sincos(first.1), a), c);
    sub(second.0.rotate(sincos(second.1), turned), add(c, a))
}

/// The tilting head of V as written in a machine file.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Deserialize, serde::Serialize), serde(deny_unknown_fields))]
pub struct HeadParameters {
    /// Centre CR2 relative to the platform's point P, in {B_V}, mm.
    pub c_mm: Vec3,
    /// s_b = ±1.
    #[cfg_attr(feature = "serde", serde(default = "plus"))]
    pub head_sense: i8,
}

/// One mechanism of the HV-Mill as written in a machine file.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Deserialize, serde::Serialize), serde(deny_unknown_fields))]
pub struct HvMillParameters {
    /// Which mechanism.
    pub spindle: Spindle,
    /// 3: rotary axes locked at 0; 4: the table turns; 5: table and head turn (V with head only).
    pub controlled_axes: u8,
    /// Its MOMA 4S, tool included.
    pub mechanism: Moma4sParameters,
    /// Centre of the rotary table in {B_j}, mm.
    pub cr_mm: Vec3,
    /// Origin of {W} relative to the table's centre, in {B_j}, mm.
    pub w0_mm: Vec3,
    /// s_θ = ±1.
    #[cfg_attr(feature = "serde", serde(default = "plus"))]
    pub table_sense: i8,
    /// V only.
    #[cfg_attr(feature = "serde", serde(default))]
    pub head: Option<HeadParameters>,
}

#[cfg(feature = "serde")]
fn plus() -> i8 {
    1
}

impl HvMillParameters {
    /// H with the default dimensions, **inferred**: the paper gives none.
    pub fn h(controlled_axes: u8) -> Self {
        Self {
            spindle: Spindle::H,
            controlled_axes,
            mechanism: Moma4sParameters { l_t_mm: 100.0, alpha_t_deg: 90.0, ..Moma4sConfiguration::P.into() },
            cr_mm: [0.0, -430.0, -100.0],
            w0_mm: [0.0, 160.0, 60.0],
            table_sense: 1,
            head: None,
        }
    }

    /// V with the default dimensions, **inferred**: the paper gives none.
    pub fn v(controlled_axes: u8) -> Self {
        Self {
            spindle: Spindle::V,
            controlled_axes,
            mechanism: Moma4sParameters { l_t_mm: 80.0, alpha_t_deg: 0.0, ..Moma4sConfiguration::P.into() },
            cr_mm: [0.0, 200.0, -510.0],
            w0_mm: [0.0, 0.0, 160.0],
            table_sense: 1,
            head: Some(HeadParameters { c_mm: [0.0, 0.0, -20.0], head_sense: 1 }),
        }
    }
}

/// One valid mechanism of the HV-Mill with carriage, table and head.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HvMill {
    spindle: Spindle,
    controlled_axes: u8,
    mechanism: Moma4s,
    cr: Vec3,
    w0: Vec3,
    table_sense: f64,
    head_sense: f64,
    /// Tip relative to CR2 at p5 = 0; zero without head.
    r_t: Vec3,
    /// τ3
    tip_third: f64,
}

/// The programmed state of one mechanism: tip in {W}, table, head (mm, rad), or their rates.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct HvState {
    /// Tip in {W}.
    pub w: Vec3,
    /// p4, rad.
    pub table: f64,
    /// p5, rad.
    pub head: f64,
}

impl HvState {
    fn is_finite(&self) -> bool {
        is_finite(self.w) && self.table.is_finite() && self.head.is_finite()
    }
}

/// Rotated vectors at one state.
struct Turned {
    table: (f64, f64),
    /// R_θ A
    workpiece: Vec3,
    /// R_b r_t
    tool: Vec3,
}

impl HvMill {
    /// One mechanism from its parameters.
    ///
    /// # Errors
    /// Those of [`Moma4s::new`]; `OutOfRange` if `controlled_axes` is not 3, 4 or 5, or 5 without a head; `NotASign` for the senses.
    pub fn new(p: &HvMillParameters) -> Result<Self, GeometryError> {
        let vector = |name, [x, y, z]: Vec3| -> Result<Vec3, GeometryError> {
            Ok([
                errors::coordinate(Key::at(name, 0), x)?,
                errors::coordinate(Key::at(name, 1), y)?,
                errors::coordinate(Key::at(name, 2), z)?,
            ])
        };
        let most = if p.spindle == Spindle::V && p.head.is_some() { 5 } else { 4 };
        if !(3..=most).contains(&p.controlled_axes) {
            return Err(GeometryError::OutOfRange {
                key: Key::of("controlled_axes"),
                value: f64::from(p.controlled_axes),
                low: 3.0,
                high: f64::from(most),
            });
        }
        let mechanism = Moma4s::new(&p.mechanism)?;
        let tip = p.spindle.from_q(mechanism.tool_mm());
        let (r_t, head_sense) = match (p.spindle, p.head) {
            (Spindle::V, Some(head)) => {
                (sub(tip, vector("c_mm", head.c_mm)?), errors::sign(Key::of("head_sense"), head.head_sense)?)
            }
            _ => ([0.0; 3], 1.0),
        };
        Ok(Self {
            spindle: p.spindle,
            controlled_axes: p.controlled_axes,
            mechanism,
            cr: vector("cr_mm", p.cr_mm)?,
            w0: vector("w0_mm", p.w0_mm)?,
            table_sense: errors::sign(Key::of("table_sense"), p.table_sense)?,
            head_sense,
            r_t,
            tip_third: p.spindle.split(tip).1,
        })
    }

    /// Which mechanism.
    pub fn spindle(&self) -> Spindle {
        self.spindle
    }

    /// Its MOMA 4S.
    pub fn mechanism(&self) -> &Moma4s {
        &self.mechanism
    }

    /// Centre of the rotary table in {B_j} with the carriage at p3, mm.
    pub fn table_centre_mm(&self, carriage_mm: f64) -> Vec3 {
        let (plane, third) = self.spindle.split(self.cr);
        self.spindle.join(plane, third - carriage_mm)
    }

    /// {W} in {B_j} with the carriage at p3 (mm) and the table at p4 (rad): origin (mm) and unit vectors x y z.
    pub fn workpiece_frame(&self, carriage_mm: f64, table_rad: f64) -> (Vec3, [Vec3; 3]) {
        let table = sincos(self.table_sense * table_rad);
        let turn = |v| self.spindle.table().rotate(table, v);
        let origin = add(self.table_centre_mm(carriage_mm), turn(self.w0));
        (origin, [turn([1.0, 0.0, 0.0]), turn([0.0, 1.0, 0.0]), turn([0.0, 0.0, 1.0])])
    }

    /// Origin of {W} relative to the table's centre, table at 0, in {B_j}, mm.
    pub fn workpiece_mm(&self) -> Vec3 {
        self.w0
    }

    /// The tool in {B_j} with the 4S's tip at q (head at 0) and the head at p5 (rad): platform point P, centre of the head
    /// (the tip, if there is no head) and tip, mm.
    pub fn tool_points(&self, q: Vec2, head_rad: f64) -> [Vec3; 3] {
        let tool = self.spindle.from_q(self.mechanism.tool_mm());
        let platform = sub(self.spindle.join(q, self.tip_third), tool);
        let centre = add(platform, sub(tool, self.r_t));
        let turned = match self.controlled_axes {
            5 => Turn::Y.rotate(sincos(self.head_sense * head_rad), self.r_t),
            _ => self.r_t,
        };
        [platform, centre, add(centre, turned)]
    }

    /// The coordinates of a pose that drive this mechanism.
    fn state(&self, pose: &Pose) -> HvState {
        let w = [pose.x, pose.y, pose.z];
        match self.spindle {
            Spindle::H => HvState { w, table: pose.b, head: 0.0 },
            Spindle::V => HvState { w, table: pose.c, head: pose.b },
        }
    }

    fn pose(&self, state: HvState) -> Pose {
        let [x, y, z] = state.w;
        match self.spindle {
            Spindle::H => Pose { x, y, z, b: state.table, ..Pose::ZERO },
            Spindle::V => Pose { x, y, z, b: state.head, c: state.table, ..Pose::ZERO },
        }
    }

    /// A rotary axis that this mode does not move must be 0.
    fn locked(&self, state: &HvState) -> Option<(Axis, u8)> {
        let table_axis = if self.spindle == Spindle::H { Axis::B } else { Axis::C };
        if self.controlled_axes < 4 && state.table != 0.0 {
            return Some((table_axis, 3));
        }
        if self.controlled_axes < 5 && state.head != 0.0 {
            return Some((Axis::B, 4));
        }
        None
    }

    #[inline]
    fn turn(&self, state: &HvState) -> Turned {
        let table = sincos(self.table_sense * state.table);
        let workpiece = self.spindle.table().rotate(table, add(self.w0, state.w));
        let tool = if self.controlled_axes == 5 {
            Turn::Y.rotate(sincos(self.head_sense * state.head), self.r_t)
        } else {
            self.r_t
        };
        Turned { table, workpiece, tool }
    }

    /// Corrected translational coordinates: cr + A + ΔT, written as cr + R_θ A − (R_b − 1) r_t.
    #[inline]
    fn corrected(&self, turned: &Turned) -> (Vec2, f64) {
        self.spindle.split(add(self.cr, sub(turned.workpiece, sub(turned.tool, self.r_t))))
    }

    /// ΔT in {B_j}, mm: what the turned table and head add to the translational coordinates (\[HV\] (10), corrected).
    ///
    /// # Errors
    /// `NotFinite`, `AxisLocked`.
    pub fn delta_t(&self, state: &HvState) -> Result<Vec3, InverseError> {
        self.check(state)?;
        let turned = self.turn(state);
        Ok(sub(sub(turned.workpiece, add(self.w0, state.w)), sub(turned.tool, self.r_t)))
    }

    /// Unit vector from tip to spindle in {W}: R_θᵀ R_b (0, 0, 1).
    ///
    /// # Errors
    /// `NotFinite`, `AxisLocked`.
    pub fn tool_axis(&self, state: &HvState) -> Result<Vec3, InverseError> {
        self.check(state)?;
        let (s, c) = sincos(self.table_sense * state.table);
        let tilted = Turn::Y.rotate(sincos(self.head_sense * state.head), [0.0, 0.0, 1.0]);
        Ok(self.spindle.table().rotate((-s, c), tilted))
    }

    #[inline]
    fn check(&self, state: &HvState) -> Result<(), InverseError> {
        if !state.is_finite() {
            return Err(InverseError::NotFinite);
        }
        match self.locked(state) {
            Some((axis, _)) => Err(InverseError::AxisLocked { axis }),
            None => Ok(()),
        }
    }

    /// State → p1, p2, p3 (mm).
    ///
    /// # Errors
    /// Those of the MOMA 4S, `NotFinite`, `AxisLocked`.
    #[inline]
    pub fn inverse_3(&self, state: &HvState) -> Result<[f64; 3], InverseError> {
        self.check(state)?;
        let (q, third) = self.corrected(&self.turn(state));
        let [p1, p2] = self.mechanism.planar.inverse(q)?;
        Ok([p1, p2, third - self.tip_third])
    }

    /// p1, p2, p3 (mm), p4, p5 (rad) → state.
    ///
    /// # Errors
    /// Those of the MOMA 4S, `NotFinite`, `JointLocked`.
    pub fn forward_5(&self, [p1, p2, p3, p4, p5]: [f64; 5]) -> Result<HvState, ForwardError> {
        if !(p3.is_finite() && p4.is_finite() && p5.is_finite()) {
            return Err(ForwardError::NotFinite);
        }
        if let Some((_, joint)) = self.locked(&HvState { w: [0.0; 3], table: p4, head: p5 }) {
            return Err(ForwardError::JointLocked { joint });
        }
        Ok(self.place(self.mechanism.planar.forward([p1, p2])?, p3, p4, p5))
    }

    /// The tip in {W} for the 4S's tip at q (as with p5 = 0), the carriage at p3 (mm), table and head (rad).
    pub fn place(&self, q: Vec2, p3: f64, table: f64, head: f64) -> HvState {
        let (s, c) = sincos(self.table_sense * table);
        let tilted = if self.controlled_axes == 5 {
            Turn::Y.rotate(sincos(self.head_sense * head), self.r_t)
        } else {
            self.r_t
        };
        let tip = add(self.spindle.join(q, self.tip_third + p3), sub(tilted, self.r_t));
        let w = sub(self.spindle.table().rotate((-s, c), sub(tip, self.cr)), self.w0);
        HvState { w, table, head }
    }

    /// ∂(p1, p2, p3)/∂(w, p4, p5): rows joints; mm/mm and mm/rad.
    ///
    /// # Errors
    /// As [`Self::inverse_3`], and `Singular` where the MOMA 4S is.
    pub fn jacobian_3x5(&self, state: &HvState) -> Result<[[f64; 5]; 3], InverseError> {
        self.check(state)?;
        let turned = self.turn(state);
        let planar = &self.mechanism.planar;
        let (q, _) = self.corrected(&turned);
        let k = planar.rates(&planar.solve(q)?)?;
        let axis = self.spindle.table();
        let mut rows = [[0.0; 5]; 3];
        let columns = [
            axis.rotate(turned.table, [1.0, 0.0, 0.0]),
            axis.rotate(turned.table, [0.0, 1.0, 0.0]),
            axis.rotate(turned.table, [0.0, 0.0, 1.0]),
            scale(self.table_sense, axis.cross(turned.workpiece)),
            scale(-self.head_sense, Turn::Y.cross(turned.tool)),
        ];
        let [row1, row2, row3] = &mut rows;
        for (((e1, e2), e3), column) in row1.iter_mut().zip(row2).zip(row3).zip(columns) {
            let (dq, third) = self.spindle.split(column);
            *e1 = k[0][0] * dq[0] + k[0][1] * dq[1];
            *e2 = k[1][0] * dq[0] + k[1][1] * dq[1];
            *e3 = third;
        }
        Ok(rows)
    }

    /// p1..p3, their rates and accelerations. The turned vectors add Coriolis and centripetal terms:
    /// d²(R A)/dt² = R Ä + 2 θ̇ e × R Ȧ + θ̈ e × R A + θ̇² e × (e × R A).
    ///
    /// # Errors
    /// As [`Self::jacobian_3x5`].
    pub fn motion_3(
        &self,
        state: &HvState,
        velocity: &HvState,
        acceleration: &HvState,
    ) -> Result<[[f64; 3]; 3], InverseError> {
        self.check(state)?;
        if !(velocity.is_finite() && acceleration.is_finite()) {
            return Err(InverseError::NotFinite);
        }
        if let Some((axis, _)) = self.locked(velocity).or(self.locked(acceleration)) {
            return Err(InverseError::AxisLocked { axis });
        }
        let turned = self.turn(state);
        let axis = self.spindle.table();
        let (rate, rate_2) = (self.table_sense * velocity.table, self.table_sense * acceleration.table);
        let moved = axis.rotate(turned.table, velocity.w);
        let around = axis.cross(turned.workpiece);
        let mut v = add(moved, scale(rate, around));
        let mut a = add(
            add(axis.rotate(turned.table, acceleration.w), scale(2.0 * rate, axis.cross(moved))),
            add(scale(rate_2, around), scale(rate * rate, axis.cross(around))),
        );
        let (tilt, tilt_2) = (self.head_sense * velocity.head, self.head_sense * acceleration.head);
        let swing = Turn::Y.cross(turned.tool);
        v = sub(v, scale(tilt, swing));
        a = sub(a, add(scale(tilt_2, swing), scale(tilt * tilt, Turn::Y.cross(swing))));

        let (q, third) = self.corrected(&turned);
        let (q_v, third_v) = self.spindle.split(v);
        let (q_a, third_a) = self.spindle.split(a);
        let [p, p_v, p_a] = self.mechanism.planar.motion_2(q, q_v, q_a)?;
        Ok([[p[0], p[1], third - self.tip_third], [p_v[0], p_v[1], third_v], [p_a[0], p_a[1], third_a]])
    }

    pub(crate) fn singularity_of(&self, state: &HvState) -> Result<Singularity, InverseError> {
        self.check(state)?;
        let (q, _) = self.corrected(&self.turn(state));
        Ok(self.mechanism.planar.measures(&self.mechanism.planar.solve(q)?))
    }
}

impl TryFrom<HvMillParameters> for HvMill {
    type Error = GeometryError;
    fn try_from(parameters: HvMillParameters) -> Result<Self, GeometryError> {
        Self::new(&parameters)
    }
}

fn pack([p1, p2, p3]: [f64; 3], table: f64, head: f64) -> Joints {
    let mut joints = [0.0; MAX_JOINTS];
    [joints[0], joints[1], joints[2], joints[3], joints[4]] = [p1, p2, p3, table, head];
    joints
}

impl Kinematics for HvMill {
    fn joint_count(&self) -> usize {
        match self.spindle {
            Spindle::H => 4,
            Spindle::V => 5,
        }
    }

    fn axes(&self) -> AxisSet {
        match self.spindle {
            Spindle::H => AxisSet::new(&[Axis::X, Axis::Y, Axis::Z, Axis::B]),
            Spindle::V => AxisSet::new(&[Axis::X, Axis::Y, Axis::Z, Axis::B, Axis::C]),
        }
    }

    fn joint_kind(&self, joint: usize) -> JointKind {
        if joint < 3 { JointKind::Linear } else { JointKind::Rotary }
    }

    fn joint_code(&self, joint: usize) -> (&'static str, &'static str) {
        ("", crate::machine::number(joint))
    }

    fn inverse(&self, pose: &Pose) -> Result<Joints, InverseError> {
        let state = self.state(pose);
        Ok(pack(self.inverse_3(&state)?, state.table, state.head))
    }

    fn forward(&self, p: &Joints, _: &Pose) -> Result<Pose, ForwardError> {
        let head = if self.spindle == Spindle::V { p[4] } else { 0.0 };
        Ok(self.pose(self.forward_5([p[0], p[1], p[2], p[3], head])?))
    }

    fn jacobian(&self, pose: &Pose) -> Result<Jacobian, InverseError> {
        let rows = self.jacobian_3x5(&self.state(pose))?;
        let mut jacobian = [[0.0; 9]; MAX_JOINTS];
        for (row, [x, y, z, table, head]) in jacobian.iter_mut().zip(rows) {
            *row = match self.spindle {
                Spindle::H => [x, y, z, 0.0, table, 0.0, 0.0, 0.0, 0.0],
                Spindle::V => [x, y, z, 0.0, head, table, 0.0, 0.0, 0.0],
            };
        }
        match self.spindle {
            Spindle::H => jacobian[3][4] = 1.0,
            Spindle::V => {
                jacobian[3][5] = 1.0;
                jacobian[4][4] = 1.0;
            }
        }
        Ok(jacobian)
    }

    fn motion(&self, pose: &Pose, velocity: &Pose, acceleration: &Pose) -> Result<JointMotion, InverseError> {
        let (state, v, a) = (self.state(pose), self.state(velocity), self.state(acceleration));
        let [p, p_v, p_a] = self.motion_3(&state, &v, &a)?;
        Ok(JointMotion {
            position: pack(p, state.table, state.head),
            velocity: pack(p_v, v.table, v.head),
            acceleration: pack(p_a, a.table, a.head),
        })
    }

    fn singularity(&self, pose: &Pose) -> Result<Singularity, InverseError> {
        self.singularity_of(&self.state(pose))
    }

    fn inverse_branches(&self, pose: &Pose) -> Result<Branches<Joints>, InverseError> {
        let state = self.state(pose);
        self.check(&state)?;
        let (q, third) = self.corrected(&self.turn(&state));
        let mut all = Branches::new();
        for &[p1, p2] in self.mechanism.planar.inverse_all(q).as_slice() {
            all.push(pack([p1, p2, third - self.tip_third], state.table, state.head));
        }
        if all.as_slice().is_empty() {
            all.push(self.inverse(pose)?);
        }
        Ok(all)
    }

    fn forward_branches(&self, p: &Joints, seed: &Pose) -> Result<Branches<Pose>, ForwardError> {
        let mut all = Branches::new();
        let head = if self.spindle == Spindle::V { p[4] } else { 0.0 };
        if p[2].is_finite() && p[3].is_finite() && head.is_finite() {
            for &q in self.mechanism.planar.forward_all([p[0], p[1]]).as_slice() {
                all.push(self.pose(self.place(q, p[2], p[3], head)));
            }
        }
        if all.as_slice().is_empty() {
            all.push(self.forward(p, seed)?);
        }
        Ok(all)
    }
}
