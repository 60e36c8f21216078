//! The whole MOMA HV-Mill: both mechanisms on one carriage and table, one of them active (\[HV\] figs 2a and 2b).
//!
//! Source and symbols: [`crate::hv_mill`].
//! Frame: H: X Y Z B (table) in {W} of H; V: U V W C (table) and B (head, fig 2b) in {W} of V, mm and rad.
//! Joints: H1 H2 V1 V2 carriage table (head). The idle mechanism holds its joints; so does the head in H.
//!
//! Inverse, forward, Jacobian: those of the active [`HvMill`]; rows of held joints are zero, and coordinates of the idle
//! mechanism keep their value (forward copies them from the seed). Moving an idle coordinate is `AxisLocked`.
//! Switching the active mechanism is a command of its own ([`HvMachine::switch`]), never a by-product of a move.

use crate::errors::{ForwardError, GeometryError, InverseError, Key};
use crate::hv_mill::{HeadParameters, HvMill, HvMillParameters, HvState, Spindle};
use crate::kinematics::{
    Branches, Jacobian, JointKind, JointMotion, Joints, Kinematics, MAX_JOINTS, Singularity,
};
use crate::moma_4s::Moma4sParameters;
use crate::pose::{Axis, AxisSet, Pose};
use crate::vector::Vec3;

/// One of the two mechanisms as written in a machine file.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Deserialize, serde::Serialize), serde(deny_unknown_fields))]
pub struct HvSideParameters {
    /// Its MOMA 4S, tool included.
    pub mechanism: Moma4sParameters,
    /// Centre of the rotary table in {B_j}, mm.
    pub cr_mm: Vec3,
    /// Origin of {W} relative to the table's centre, in {B_j}, mm.
    pub w0_mm: Vec3,
    /// s_θ = ±1.
    #[cfg_attr(feature = "serde", serde(default = "plus"))]
    pub table_sense: i8,
    /// Where its two joints stand until it is first activated, mm.
    pub rest_mm: [f64; 2],
}

#[cfg(feature = "serde")]
fn plus() -> i8 {
    1
}

/// The HV-Mill with both mechanisms as written in a machine file.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Deserialize, serde::Serialize), serde(deny_unknown_fields))]
pub struct HvMachineParameters {
    /// The horizontal mechanism.
    pub h: HvSideParameters,
    /// The vertical mechanism.
    pub v: HvSideParameters,
    /// Present: seven joints (fig 2b); absent: six (fig 2a).
    #[cfg_attr(feature = "serde", serde(default))]
    pub head: Option<HeadParameters>,
    /// The mechanism that is active at start.
    pub active: Spindle,
}

impl HvMachineParameters {
    /// Fig 2a with the default dimensions, **inferred**.
    pub fn six() -> Self {
        let side = |p: HvMillParameters| HvSideParameters {
            mechanism: p.mechanism,
            cr_mm: p.cr_mm,
            w0_mm: p.w0_mm,
            table_sense: p.table_sense,
            rest_mm: [100.0, 100.0],
        };
        Self {
            h: side(HvMillParameters::h(4)),
            v: side(HvMillParameters::v(4)),
            head: None,
            active: Spindle::H,
        }
    }

    /// Fig 2b with the default dimensions, **inferred**.
    pub fn seven() -> Self {
        Self { head: HvMillParameters::v(5).head, ..Self::six() }
    }
}

/// A valid HV-Mill with both mechanisms.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HvMachine {
    h: HvMill,
    v: HvMill,
    head: bool,
    active: Spindle,
    /// Held joints of the idle mechanism, mm.
    held: [f64; 2],
    /// Held head angle while H is active, rad.
    held_head: f64,
}

impl HvMachine {
    /// A machine from its parameters.
    ///
    /// # Errors
    /// Those of [`HvMill::new`]; `NotFinite`, `OutOfRange` for `rest_mm`.
    pub fn new(p: &HvMachineParameters) -> Result<Self, GeometryError> {
        let side = |spindle, side: &HvSideParameters, controlled_axes, head| {
            HvMill::new(&HvMillParameters {
                spindle,
                controlled_axes,
                mechanism: side.mechanism,
                cr_mm: side.cr_mm,
                w0_mm: side.w0_mm,
                table_sense: side.table_sense,
                head,
            })
        };
        let idle = match p.active {
            Spindle::H => &p.v,
            Spindle::V => &p.h,
        };
        let [rest1, rest2] = idle.rest_mm;
        let held = [
            crate::errors::coordinate(Key::at("rest_mm", 0), rest1)?,
            crate::errors::coordinate(Key::at("rest_mm", 1), rest2)?,
        ];
        Ok(Self {
            h: side(Spindle::H, &p.h, 4, None)?,
            v: side(Spindle::V, &p.v, if p.head.is_some() { 5 } else { 4 }, p.head)?,
            head: p.head.is_some(),
            active: p.active,
            held,
            held_head: 0.0,
        })
    }

    /// H and V.
    pub fn mechanisms(&self) -> [&HvMill; 2] {
        [&self.h, &self.v]
    }

    /// The mechanism that follows the program.
    pub fn active(&self) -> Spindle {
        self.active
    }

    /// The active mechanism itself.
    pub fn mechanism(&self) -> &HvMill {
        match self.active {
            Spindle::H => &self.h,
            Spindle::V => &self.v,
        }
    }

    /// Makes `to` the active mechanism, with the machine standing at `joints` (seven places, the head's 0 on fig 2a) and the
    /// program at `pose`. Returns the machine from now on and the pose it stands at: the coordinates of `to` from its joints,
    /// the others as they were. Nothing moves. Switching to the active one returns the machine as it is.
    ///
    /// # Errors
    /// Those of the forward kinematics of `to`: its held joints must be a valid state of it.
    pub fn switch(&self, to: Spindle, joints: &Joints, pose: &Pose) -> Result<(Self, Pose), ForwardError> {
        let mut machine = *self;
        machine.active = to;
        if to != self.active {
            machine.held = match self.active {
                Spindle::H => [joints[0], joints[1]],
                Spindle::V => [joints[2], joints[3]],
            };
            machine.held_head = if self.head { joints[6] } else { 0.0 };
        }
        let pose = machine.forward(joints, pose)?;
        Ok((machine, pose))
    }

    /// The machine with `active` following the program and everything else held where `joints` (seven places) says: for a
    /// controller that drives joints one by one, as LinuxCNC does before homing. Nothing is checked.
    pub fn holding(mut self, active: Spindle, joints: &Joints) -> Self {
        self.active = active;
        self.held = match active {
            Spindle::H => [joints[2], joints[3]],
            Spindle::V => [joints[0], joints[1]],
        };
        self.held_head = if self.head { joints[6] } else { 0.0 };
        self
    }

    /// The coordinates of the active mechanism.
    fn state(&self, p: &Pose) -> HvState {
        match self.active {
            Spindle::H => HvState { w: [p.x, p.y, p.z], table: p.b, head: 0.0 },
            Spindle::V => HvState { w: [p.u, p.v, p.w], table: p.c, head: if self.head { p.b } else { 0.0 } },
        }
    }

    /// The same state in the coordinates of the active mechanism alone.
    pub(crate) fn mechanism_pose(&self, pose: &Pose) -> Pose {
        let state = self.state(pose);
        let [x, y, z] = state.w;
        match self.active {
            Spindle::H => Pose { x, y, z, b: state.table, ..Pose::ZERO },
            Spindle::V => Pose { x, y, z, b: state.head, c: state.table, ..Pose::ZERO },
        }
    }

    /// The first axis that the active mechanism does not have and whose rate (or displacement) is not 0.
    pub fn idle_axis(&self, rate: &Pose) -> Option<Axis> {
        let idle: &[Axis] = match (self.active, self.head) {
            (Spindle::H, _) => &[Axis::C, Axis::U, Axis::V, Axis::W],
            (Spindle::V, true) => &[Axis::X, Axis::Y, Axis::Z],
            (Spindle::V, false) => &[Axis::X, Axis::Y, Axis::Z, Axis::B],
        };
        idle.iter().copied().find(|axis| rate.get(*axis) != 0.0)
    }

    /// All joints: the active mechanism's, the shared ones, and what is held (or 0 for rates).
    fn pack(&self, [p1, p2, p3]: [f64; 3], state: &HvState, held: [f64; 2], held_head: f64) -> Joints {
        let mut joints = [0.0; MAX_JOINTS];
        let [h, v] = match self.active {
            Spindle::H => [[p1, p2], held],
            Spindle::V => [held, [p1, p2]],
        };
        let head = match (self.head, self.active) {
            (false, _) => 0.0,
            (true, Spindle::H) => held_head,
            (true, Spindle::V) => state.head,
        };
        [joints[0], joints[1], joints[2], joints[3]] = [h[0], h[1], v[0], v[1]];
        [joints[4], joints[5], joints[6]] = [p3, state.table, head];
        joints
    }

    /// Rows of the active mechanism among the joints.
    const fn first_joint(&self) -> usize {
        match self.active {
            Spindle::H => 0,
            Spindle::V => 2,
        }
    }
}

impl TryFrom<HvMachineParameters> for HvMachine {
    type Error = GeometryError;
    fn try_from(parameters: HvMachineParameters) -> Result<Self, GeometryError> {
        Self::new(&parameters)
    }
}

impl Kinematics for HvMachine {
    fn joint_count(&self) -> usize {
        if self.head { 7 } else { 6 }
    }

    fn axes(&self) -> AxisSet {
        AxisSet::new(&[Axis::X, Axis::Y, Axis::Z, Axis::B, Axis::C, Axis::U, Axis::V, Axis::W])
    }

    fn joint_kind(&self, joint: usize) -> JointKind {
        if joint < 5 { JointKind::Linear } else { JointKind::Rotary }
    }

    fn joint_code(&self, joint: usize) -> (&'static str, &'static str) {
        let names = ["H1", "H2", "V1", "V2", "carriage", "table", "head"];
        ("", names.get(joint).copied().unwrap_or("?"))
    }

    fn inverse(&self, pose: &Pose) -> Result<Joints, InverseError> {
        let state = self.state(pose);
        let p = self.mechanism().inverse_3(&state)?;
        Ok(self.pack(p, &state, self.held, self.held_head))
    }

    fn forward(&self, p: &Joints, seed: &Pose) -> Result<Pose, ForwardError> {
        let state = match self.active {
            Spindle::H => self.h.forward_5([p[0], p[1], p[4], p[5], 0.0])?,
            Spindle::V => self.v.forward_5([p[2], p[3], p[4], p[5], if self.head { p[6] } else { 0.0 }])?,
        };
        let mut pose = *seed;
        match self.active {
            Spindle::H => {
                [pose.x, pose.y, pose.z] = state.w;
                pose.b = state.table;
            }
            Spindle::V => {
                [pose.u, pose.v, pose.w] = state.w;
                pose.c = state.table;
                if self.head {
                    pose.b = state.head;
                }
            }
        }
        Ok(pose)
    }

    fn jacobian(&self, pose: &Pose) -> Result<Jacobian, InverseError> {
        let [row1, row2, row3] = self.mechanism().jacobian_3x5(&self.state(pose))?;
        let mut jacobian = [[0.0; 9]; MAX_JOINTS];
        let place = |[x, y, z, table, head]: [f64; 5]| match self.active {
            Spindle::H => [x, y, z, 0.0, table, 0.0, 0.0, 0.0, 0.0],
            Spindle::V => [0.0, 0.0, 0.0, 0.0, if self.head { head } else { 0.0 }, table, x, y, z],
        };
        for (joint, row) in
            [(self.first_joint(), row1), (self.first_joint() + 1, row2), (4, row3)].into_iter()
        {
            if let Some(place_of_row) = jacobian.get_mut(joint) {
                *place_of_row = place(row);
            }
        }
        match self.active {
            Spindle::H => jacobian[5][4] = 1.0,
            Spindle::V => {
                jacobian[5][5] = 1.0;
                if self.head {
                    jacobian[6][4] = 1.0;
                }
            }
        }
        Ok(jacobian)
    }

    fn motion(&self, pose: &Pose, velocity: &Pose, acceleration: &Pose) -> Result<JointMotion, InverseError> {
        if let Some(axis) = self.idle_axis(velocity).or(self.idle_axis(acceleration)) {
            return Err(InverseError::AxisLocked { axis });
        }
        let (state, v, a) = (self.state(pose), self.state(velocity), self.state(acceleration));
        let [p, p_v, p_a] = self.mechanism().motion_3(&state, &v, &a)?;
        Ok(JointMotion {
            position: self.pack(p, &state, self.held, self.held_head),
            velocity: self.pack(p_v, &v, [0.0; 2], 0.0),
            acceleration: self.pack(p_a, &a, [0.0; 2], 0.0),
        })
    }

    fn singularity(&self, pose: &Pose) -> Result<Singularity, InverseError> {
        let s = self.mechanism().singularity_of(&self.state(pose))?;
        Ok(Singularity { inverse_joint: s.inverse_joint.saturating_add(self.first_joint()), ..s })
    }

    fn inverse_branches(&self, pose: &Pose) -> Result<Branches<Joints>, InverseError> {
        let state = self.state(pose);
        let mut all = Branches::new();
        for q in self.mechanism().inverse_branches(&self.mechanism_pose(pose))?.as_slice() {
            all.push(self.pack([q[0], q[1], q[2]], &state, self.held, self.held_head));
        }
        Ok(all)
    }

    fn forward_branches(&self, p: &Joints, seed: &Pose) -> Result<Branches<Pose>, ForwardError> {
        let head = if self.head { p[6] } else { 0.0 };
        let mut own = [0.0; MAX_JOINTS];
        [own[0], own[1], own[2], own[3], own[4]] = match self.active {
            Spindle::H => [p[0], p[1], p[4], p[5], 0.0],
            Spindle::V => [p[2], p[3], p[4], p[5], head],
        };
        let mut all = Branches::new();
        for found in self.mechanism().forward_branches(&own, seed)?.as_slice() {
            let mut pose = *seed;
            let w = [found.x, found.y, found.z];
            match self.active {
                Spindle::H => ([pose.x, pose.y, pose.z], pose.b) = (w, found.b),
                Spindle::V => ([pose.u, pose.v, pose.w], pose.c) = (w, found.c),
            }
            if self.head && self.active == Spindle::V {
                pose.b = found.b;
            }
            all.push(pose);
        }
        Ok(all)
    }
}
