//! The pose: the nine coordinates of LinuxCNC, X Y Z A B C U V W.
//!
//! Lengths in mm, angles in **radians** (degrees exist only at the program's face: G-code, machine files,
//! tables, traces). The frame is the machine's programming frame as its mechanism states it.

/// One of the nine Cartesian letters. Never call a joint an axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
#[repr(u8)]
#[allow(missing_docs)]
pub enum Axis {
    X,
    Y,
    Z,
    A,
    B,
    C,
    U,
    V,
    W,
}

impl Axis {
    /// All nine, in letter order.
    pub const ALL: [Axis; 9] =
        [Axis::X, Axis::Y, Axis::Z, Axis::A, Axis::B, Axis::C, Axis::U, Axis::V, Axis::W];

    /// The G-code letter.
    pub const fn letter(self) -> char {
        b"XYZABCUVW"[self as usize] as char
    }

    /// True for A, B, C, whose coordinates are angles.
    pub const fn is_rotary(self) -> bool {
        matches!(self, Axis::A | Axis::B | Axis::C)
    }
}

/// A set of axes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct AxisSet(u16);

impl AxisSet {
    /// The set of the given axes.
    pub const fn new(axes: &[Axis]) -> Self {
        let mut bits = 0;
        let mut i = 0;
        while i < axes.len() {
            bits |= 1 << axes[i] as u16;
            i += 1;
        }
        Self(bits)
    }

    /// The set with one axis more.
    pub const fn with(self, axis: Axis) -> Self {
        Self(self.0 | 1 << axis as u16)
    }

    /// True if `axis` is in the set.
    pub const fn contains(self, axis: Axis) -> bool {
        self.0 & (1 << axis as u16) != 0
    }

    /// The axes of the set in letter order.
    pub fn iter(self) -> impl Iterator<Item = Axis> {
        Axis::ALL.into_iter().filter(move |axis| self.contains(*axis))
    }
}

/// Nine coordinates (mm, rad). Also used for rates (mm/s, rad/s) where a function says so.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[repr(C)]
#[allow(missing_docs)]
pub struct Pose {
    pub x: f64,
    pub y: f64,
    pub z: f64,
    pub a: f64,
    pub b: f64,
    pub c: f64,
    pub u: f64,
    pub v: f64,
    pub w: f64,
}

impl Pose {
    /// All coordinates zero.
    pub const ZERO: Pose = Pose { x: 0.0, y: 0.0, z: 0.0, a: 0.0, b: 0.0, c: 0.0, u: 0.0, v: 0.0, w: 0.0 };

    /// The pose with the coordinates in letter order X Y Z A B C U V W (mm, rad).
    pub const fn from_array([x, y, z, a, b, c, u, v, w]: [f64; 9]) -> Self {
        Self { x, y, z, a, b, c, u, v, w }
    }

    /// The coordinates in letter order.
    pub const fn to_array(self) -> [f64; 9] {
        [self.x, self.y, self.z, self.a, self.b, self.c, self.u, self.v, self.w]
    }

    /// One coordinate.
    pub const fn get(&self, axis: Axis) -> f64 {
        match axis {
            Axis::X => self.x,
            Axis::Y => self.y,
            Axis::Z => self.z,
            Axis::A => self.a,
            Axis::B => self.b,
            Axis::C => self.c,
            Axis::U => self.u,
            Axis::V => self.v,
            Axis::W => self.w,
        }
    }

    /// Sets one coordinate.
    pub const fn set(&mut self, axis: Axis, value: f64) {
        match axis {
            Axis::X => self.x = value,
            Axis::Y => self.y = value,
            Axis::Z => self.z = value,
            Axis::A => self.a = value,
            Axis::B => self.b = value,
            Axis::C => self.c = value,
            Axis::U => self.u = value,
            Axis::V => self.v = value,
            Axis::W => self.w = value,
        }
    }

    /// True if no coordinate is NaN or infinite.
    pub const fn is_finite(&self) -> bool {
        // 0 times a number that is none is none.
        let zero = (self.x * 0.0 + self.y * 0.0 + self.z * 0.0)
            + (self.a * 0.0 + self.b * 0.0 + self.c * 0.0)
            + (self.u * 0.0 + self.v * 0.0 + self.w * 0.0);
        zero == 0.0
    }
}
