//! What LinuxCNC's motion controller does with a kinematics module, one servo period at a time (its control.c).

use crate::stub::Module;
use pkm_kins::{Joints, MAX_JOINTS};

#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Mode {
    /// The commands are the feedback.
    Off,
    /// The joints are driven one by one.
    Joint,
    /// The pose is driven, by jogging.
    World,
    /// The pose is driven, by a program.
    Program,
}

pub(crate) struct Motmod<'a> {
    module: &'a Module,
    mode: Mode,
    /// The axes' command, from which the joints' follows in [`Mode::World`] and [`Mode::Program`].
    pub(crate) pose: [f64; 9],
    /// The axes' feedback.
    pub(crate) feedback: [f64; 9],
    /// The joints' commands; in [`Mode::Joint`] they may be set.
    pub(crate) joints: Joints,
    /// Where the drives keep the joints away from their commands.
    pub(crate) following_error: Joints,
    /// Joints before interpolation, the latest last; empty: drained.
    points: Vec<Joints>,
    /// The joints as the pose's command gave them, or their own commands: where they come to rest if nothing else happens.
    pub(crate) coarse: Joints,
    /// `motion.switchkins-type` from the next period on.
    pub(crate) switch: Option<i32>,
}

impl<'a> Motmod<'a> {
    /// A homed machine, standing at `joints` in joint mode.
    pub(crate) fn homed(module: &'a Module, joints: &[f64]) -> Self {
        let mut all = [0.0; MAX_JOINTS];
        all[..joints.len()].copy_from_slice(joints);
        let mut motmod = Self {
            module,
            mode: Mode::Joint,
            pose: [0.0; 9],
            feedback: [0.0; 9],
            joints: all,
            following_error: [0.0; MAX_JOINTS],
            points: Vec::new(),
            coarse: all,
            switch: None,
        };
        motmod.periods(Mode::Joint, 4);
        motmod
    }

    /// One servo period; false if the module refuses the switch or the pose.
    pub(crate) fn period(&mut self, mode: Mode) -> bool {
        let mut good = true;
        if let Some(to) = self.switch.take() {
            good = unsafe { (self.module.switch)(to) } == 0;
            if good {
                self.forward_command(self.joints);
            }
        }
        let mut measured = self.joints;
        for (joint, error) in measured.iter_mut().zip(&self.following_error) {
            *joint += error;
        }
        if let Ok(pose) = self.module.forward(&measured, &self.feedback) {
            self.feedback = pose;
        }
        if mode != self.mode {
            self.points.clear();
            if mode == Mode::World {
                self.forward_command(self.coarse);
            }
            self.mode = mode;
        }
        match mode {
            Mode::Off => (self.pose, self.joints) = (self.feedback, measured),
            Mode::Joint => {
                self.forward_command(self.coarse);
                self.coarse = self.joints;
            }
            Mode::World | Mode::Program => match self.module.inverse(&self.pose) {
                Ok(point) => self.interpolate(point),
                Err(_) => good = false,
            },
        }
        good
    }

    fn forward_command(&mut self, joints: Joints) {
        if let Ok(pose) = self.module.forward(&joints, &self.pose) {
            self.pose = pose;
        }
    }

    /// The cubic through the last four points, at its second: two periods late.
    fn interpolate(&mut self, point: Joints) {
        self.coarse = point;
        if self.points.is_empty() {
            self.points = vec![point; 3];
        }
        self.points.push(point);
        if let [.., a, b, c, _] = self.points.as_slice() {
            self.joints = std::array::from_fn(|i| (a[i] + 4.0 * b[i] + c[i]) / 6.0);
        }
    }

    pub(crate) fn periods(&mut self, mode: Mode, count: usize) {
        for _ in 0..count {
            assert!(self.period(mode), "{mode:?} {:?}", crate::stub::messages());
        }
    }

    /// Ten periods in which no joint moves more than this from where it stood.
    pub(crate) fn stands(&mut self, mode: Mode, at: &Joints, within: f64) {
        for period in 0..10 {
            assert!(self.period(mode), "{mode:?} {:?}", crate::stub::messages());
            for (joint, (now, then)) in self.joints.iter().zip(at).enumerate() {
                assert!(
                    (now - then).abs() <= within,
                    "{mode:?}, period {period}: joint {joint} at {now}, not {then}"
                );
            }
        }
    }
}
