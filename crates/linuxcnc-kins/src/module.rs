//! What all modules do: keep the geometry in step with HAL, convert units, count and tell errors.

use crate::ffi::{self, Hal};
use crate::mechanism::Mechanism;
use crate::message::Message;
use core::ffi::c_int;
use core::sync::atomic::Ordering::Relaxed;
use pkm_kins::maths::{degrees, fabs, radians};
use pkm_kins::{Joints, MAX_JOINTS, Named, Pose, Slot};

/// Geometry words looked at per call, and the most groups of them: a change is seen at the latest after so many calls.
pub(crate) const GROUP: usize = 2;
pub(crate) const MOST_GROUPS: usize = 32;

/// How far a joint may be moved by a change of geometry while LinuxCNC drives the machine, mm or degrees.
const MOST_JUMP: f64 = 0.5;

/// Time between two messages, ns.
const PAUSE_NS: i64 = 1_000_000_000;

/// Calls of forward without one of inverse, after which LinuxCNC is not driving the pose.
pub(crate) const QUIET: u32 = 3;

/// A module's state. One real-time thread calls it.
pub(crate) struct State<M: Mechanism> {
    hal: Option<Hal>,
    /// The words as they were when the mechanism was made.
    seen: [[u64; GROUP]; MOST_GROUPS],
    /// The group to be looked at next.
    group: usize,
    /// Of the geometry in HAL; none while that makes no mechanism.
    machine: Option<M>,
    /// The one before, while there is none.
    before: Option<M>,
    /// Why there is none.
    why: Message,
    /// The last pose that inverse solved.
    last: Pose,
    /// Calls of forward since.
    quiet: u32,
    most_iterations: u32,
    errors: u32,
    told_ns: Option<i64>,
}

impl<M: Mechanism> Default for State<M> {
    fn default() -> Self {
        Self::new()
    }
}

impl<M: Mechanism> State<M> {
    /// Before `loadrt`.
    pub(crate) const fn new() -> Self {
        Self {
            hal: None,
            seen: [[0; GROUP]; MOST_GROUPS],
            group: 0,
            machine: None,
            before: None,
            why: Message::Plain(c"%s: not loaded\n", 0.0, 0.0),
            last: Pose::ZERO,
            quiet: QUIET,
            most_iterations: 0,
            errors: 0,
            told_ns: None,
        }
    }

    /// The parameters at load: those of a shipped machine, or nothing set (NaN, 0, no) if `name` is empty; `None` if no
    /// such machine ships.
    pub(crate) fn start(name: &[u8]) -> Option<M::Parameters> {
        if let Some((_, parameters)) = M::SHIPPED.iter().find(|(shipped, _)| shipped.as_bytes() == name) {
            return Some(parameters());
        }
        let (_, any) = M::SHIPPED.first()?;
        let mut parameters = any();
        parameters.visit(&mut |_, slot| match slot {
            Slot::Number(number) => *number = f64::NAN,
            Slot::Integer(integer) => *integer = 0,
            Slot::Flag(flag) => *flag = false,
        });
        name.is_empty().then_some(parameters)
    }

    /// Begins to work with the parameters in HAL.
    pub(crate) fn load(&mut self, hal: Hal) {
        *self = Self::new();
        self.hal = Some(hal);
        self.read_geometry();
    }

    /// Looks at one group of words.
    #[inline(always)]
    fn watch(&mut self) {
        let Some(hal) = &self.hal else { return };
        let (Some(words), Some(seen)) = (hal.groups.get(self.group), self.seen.get(self.group)) else {
            self.group = 0;
            return;
        };
        let mut changed = 0;
        for (word, seen) in words.iter().zip(seen) {
            changed |= word.load(Relaxed) ^ seen;
        }
        self.group =
            if self.group.wrapping_add(1) < hal.groups.len() { self.group.wrapping_add(1) } else { 0 };
        if changed != 0 {
            self.read_geometry();
        }
    }

    /// Makes the mechanism from what HAL says now.
    #[cold]
    #[inline(never)]
    fn read_geometry(&mut self) {
        let (Some(hal), Some((_, any))) = (&self.hal, M::SHIPPED.first()) else { return };
        let mut parameters = any();
        let mut words = hal.groups.iter().flatten();
        let mut seen = self.seen.iter_mut().flatten();
        let mut unset = None;
        let mut too_large = None;
        parameters.visit(&mut |name, slot| {
            let (Some(word), Some(place)) = (words.next(), seen.next()) else { return };
            let word = word.load(Relaxed);
            *place = word;
            let [b0, b1, b2, b3, ..] = word.to_ne_bytes();
            match slot {
                Slot::Number(number) => {
                    *number = f64::from_bits(word);
                    if !number.is_finite() {
                        unset = unset.or(Some(name.quantity));
                    }
                }
                Slot::Integer(integer) => match i8::try_from(i32::from_ne_bytes([b0, b1, b2, b3])) {
                    Ok(value) => *integer = value,
                    Err(_) => too_large = too_large.or(Some(name.quantity)),
                },
                Slot::Flag(flag) => *flag = b0 != 0,
            }
        });
        let made = if let Some(quantity) = unset {
            Err(Message::Named(
                c"%s: the geometry is not set: a %s is no number; setp it\n",
                quantity,
                0.0,
                0.0,
            ))
        } else if let Some(quantity) = too_large {
            Err(Message::Named(c"%s: the geometry makes no mechanism: %s is too large\n", quantity, 0.0, 0.0))
        } else {
            M::new(&parameters, self.machine.as_ref()).map_err(|error| Message::from(&error))
        };
        self.before = self.machine.take().or(self.before.take());
        match made.and_then(|machine| self.without_jump(machine)) {
            Ok(machine) => self.machine = Some(machine),
            Err(why) => {
                self.why = why;
                // At load nothing is set yet.
                if self.before.is_some() {
                    self.tell(why);
                }
            }
        }
    }

    /// A new geometry must not move the joints of a machine that LinuxCNC drives at this moment.
    fn without_jump(&mut self, mut machine: M) -> Result<M, Message> {
        let Some(before) = self.before.as_mut().filter(|_| self.quiet < QUIET) else { return Ok(machine) };
        let (mut now, mut then) = ([0.0; MAX_JOINTS], [0.0; MAX_JOINTS]);
        let pose = inward::<M>(&self.last);
        if before.inverse(&pose, &mut now).is_err() {
            return Ok(machine);
        }
        machine.inverse(&pose, &mut then).map_err(|error| Message::from(&error))?;
        for (joint, (now, then)) in (0_i32..).zip(now.iter().zip(&then)) {
            let turned = M::ROTARY_JOINTS.checked_shr(joint.unsigned_abs()).unwrap_or(0) & 1 == 1;
            let jump = if turned { degrees(then - now) } else { then - now };
            if !(fabs(jump) <= MOST_JUMP) {
                return Err(Message::Joint(
                    c"%s: joint %d would jump by %.3f with the changed geometry (most %.1f); set it back, or turn the machine off first\n",
                    joint,
                    jump,
                    MOST_JUMP,
                ));
            }
        }
        Ok(machine)
    }

    /// `kinematicsInverse`: 0, or −1 after telling why.
    #[inline(always)]
    pub(crate) fn inverse(&mut self, pose: &Pose, joints: &mut Joints) -> c_int {
        self.watch();
        let Some(machine) = &mut self.machine else { return self.refuse(self.why) };
        let result = if M::DEGREES {
            let solved = machine.inverse(&inward::<M>(pose), joints);
            if solved.is_ok() {
                outward_joints::<M>(joints);
            }
            solved
        } else {
            machine.inverse(pose, joints)
        };
        match result {
            Ok(()) => {
                self.last = *pose;
                self.quiet = 0;
                0
            }
            Err(error) => self.refuse_as(&error),
        }
    }

    /// `kinematicsForward`: 0, or −1 after telling why. `pose` holds the seed.
    #[inline(always)]
    pub(crate) fn forward(&mut self, joints: &Joints, pose: &mut Pose) -> c_int {
        self.watch();
        self.quiet = self.quiet.saturating_add(1);
        let Some(machine) = &mut self.machine else { return self.refuse(self.why) };
        let mut iterations = 0;
        let result = if M::DEGREES {
            let mut inner = inward::<M>(pose);
            let solved = machine.forward(&inward_joints::<M>(joints), &mut inner, &mut iterations);
            if solved.is_ok() {
                let [a, b, c] = [inner.a, inner.b, inner.c].map(degrees);
                *pose = Pose { a, b, c, ..inner };
            }
            solved
        } else {
            machine.forward(joints, pose, &mut iterations)
        };
        if M::ITERATES
            && let Some(hal) = &self.hal
        {
            self.most_iterations = self.most_iterations.max(iterations);
            hal.last_iterations.set(iterations);
            hal.max_iterations.set(self.most_iterations);
        }
        match result {
            Ok(()) => 0,
            // Before LinuxCNC knows of any joint it asks where the machine stands with all of them at 0.
            Err(_) if joints.iter().all(|joint| *joint == 0.0) => self.count(),
            Err(error) => self.refuse_as(&error),
        }
    }

    /// `kinematicsSwitch`: 0, or −1 after telling why.
    pub(crate) fn switch(&mut self, to: c_int) -> c_int {
        let Some(machine) = &mut self.machine else { return self.refuse(self.why) };
        match machine.switch(to) {
            Ok(()) => 0,
            Err(error) => self.refuse_as(&error),
        }
    }

    #[cold]
    #[inline(never)]
    fn refuse_as<'e, E>(&mut self, error: &'e E) -> c_int
    where
        Message: From<&'e E>,
    {
        self.refuse(error.into())
    }

    #[cold]
    #[inline(never)]
    fn refuse(&mut self, why: Message) -> c_int {
        self.tell(why);
        self.count()
    }

    #[cold]
    fn count(&mut self) -> c_int {
        self.errors = self.errors.wrapping_add(1);
        if let Some(hal) = &self.hal {
            hal.errors.set(self.errors);
        }
        -1
    }

    /// Tells LinuxCNC, at most once in a second: jogging against a limit refuses a thousand poses in that time.
    fn tell(&mut self, why: Message) {
        let Some(hal) = &self.hal else { return };
        let now = ffi::now_ns();
        if self.told_ns.is_none_or(|told| now.wrapping_sub(told) >= PAUSE_NS) {
            self.told_ns = Some(now);
            hal.print(&why);
        }
    }
}

/// LinuxCNC's degrees → radians.
#[inline(always)]
fn inward<M: Mechanism>(pose: &Pose) -> Pose {
    if !M::DEGREES {
        return *pose;
    }
    let [a, b, c] = [pose.a, pose.b, pose.c].map(radians);
    Pose { a, b, c, ..*pose }
}

#[inline(always)]
fn inward_joints<M: Mechanism>(joints: &Joints) -> Joints {
    let mut inner = *joints;
    each_rotary::<M>(&mut inner, radians);
    inner
}

#[inline(always)]
fn outward_joints<M: Mechanism>(joints: &mut Joints) {
    each_rotary::<M>(joints, degrees);
}

#[inline(always)]
fn each_rotary<M: Mechanism>(joints: &mut Joints, convert: fn(f64) -> f64) {
    let mut bits = M::ROTARY_JOINTS;
    for joint in joints {
        if bits & 1 == 1 {
            *joint = convert(*joint);
        }
        bits >>= 1;
    }
}
