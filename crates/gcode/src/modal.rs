//! Modal groups of G and M codes (RS274/NGC table 4; LinuxCNC's additions), and the modal state.

use pkm_canon::{Direction, LengthUnit, MotionControlMode, Plane};

/// A G code times ten: 382 is G38.2.
pub(crate) type GCode = i16;

pub(crate) const G0: GCode = 0;
pub(crate) const G1: GCode = 10;
pub(crate) const G2: GCode = 20;
pub(crate) const G3: GCode = 30;
pub(crate) const G4: GCode = 40;
pub(crate) const G5: GCode = 50;
pub(crate) const G5_1: GCode = 51;
pub(crate) const G5_2: GCode = 52;
pub(crate) const G5_3: GCode = 53;
pub(crate) const G6: GCode = 60;
pub(crate) const G6_1: GCode = 61;
pub(crate) const G6_2: GCode = 62;
pub(crate) const G10: GCode = 100;
pub(crate) const G28: GCode = 280;
pub(crate) const G28_1: GCode = 281;
pub(crate) const G30: GCode = 300;
pub(crate) const G30_1: GCode = 301;
pub(crate) const G33: GCode = 330;
pub(crate) const G33_1: GCode = 331;
pub(crate) const G38_2: GCode = 382;
pub(crate) const G38_5: GCode = 385;
pub(crate) const G43: GCode = 430;
pub(crate) const G43_1: GCode = 431;
pub(crate) const G43_2: GCode = 432;
pub(crate) const G49: GCode = 490;
pub(crate) const G52: GCode = 520;
pub(crate) const G53: GCode = 530;
pub(crate) const G64: GCode = 640;
pub(crate) const G73: GCode = 730;
pub(crate) const G74: GCode = 740;
pub(crate) const G76: GCode = 760;
pub(crate) const G80: GCode = 800;
pub(crate) const G82: GCode = 820;
pub(crate) const G83: GCode = 830;
pub(crate) const G84: GCode = 840;
pub(crate) const G86: GCode = 860;
pub(crate) const G87: GCode = 870;
pub(crate) const G88: GCode = 880;
pub(crate) const G89: GCode = 890;
pub(crate) const G92: GCode = 920;
pub(crate) const G96: GCode = 960;

/// True for the drilling cycles G73, G74, G81 to G89.
pub(crate) const fn is_cycle(code: GCode) -> bool {
    matches!(code, G73 | G74 | 810 | G82 | G83 | G84 | 850 | G86 | G87 | G88 | G89)
}

/// Modal group of a G code; also its place in a block.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub(crate) enum GGroup {
    NonModal,
    Motion,
    Plane,
    Distance,
    ArcCentre,
    FeedMode,
    Units,
    Compensation,
    ToolLength,
    Retract,
    System,
    Path,
    Spindle,
    Lathe,
    G92,
}

pub(crate) const G_GROUPS: usize = 15;

impl GGroup {
    /// The group of a code; `None` for codes RS274 does not know.
    pub(crate) const fn of(code: GCode) -> Option<Self> {
        Some(match code {
            G4 | G10 | G28 | G28_1 | G30 | G30_1 | G52 | G53 | G92 => Self::NonModal,
            G0 | G1 | G2 | G3 | G5 | G5_1 | G5_2 | G5_3 | G33 | G33_1 => Self::Motion,
            // LinuxCNC 2.10 and pkm.
            G6..=G6_2 => Self::Motion,
            G38_2..=G38_5 | G73 | G74 | G76 | G80 => Self::Motion,
            700 | 710..=712 | 720..=722 => Self::Motion,
            code if is_cycle(code) => Self::Motion,
            170 | 180 | 190 | 171 | 181 | 191 => Self::Plane,
            900 | 910 => Self::Distance,
            901 | 911 => Self::ArcCentre,
            930 | 940 | 950 => Self::FeedMode,
            200 | 210 => Self::Units,
            400 | 410 | 420 | 411 | 421 => Self::Compensation,
            G43 | G43_1 | G43_2 | G49 => Self::ToolLength,
            980 | 990 => Self::Retract,
            540 | 550 | 560 | 570 | 580 | 590..=593 => Self::System,
            610 | 611 | G64 => Self::Path,
            G96 | 970 => Self::Spindle,
            70 | 80 => Self::Lathe,
            921..=923 => Self::G92,
            _ => return None,
        })
    }

    /// The step in which a block executes the group (dialect section 7).
    #[cfg(feature = "alloc")]
    pub(crate) const fn step(self) -> u8 {
        match self {
            Self::Spindle => 2,
            Self::FeedMode => 3,
            Self::Plane => 14,
            Self::Units => 15,
            Self::Lathe => 16,
            Self::Compensation => 17,
            Self::ToolLength => 18,
            Self::System => 19,
            Self::Path => 20,
            Self::Distance => 21,
            Self::ArcCentre => 22,
            Self::Retract => 23,
            Self::NonModal => 24,
            Self::G92 => 25,
            Self::Motion => 26,
        }
    }

    #[cfg(feature = "alloc")]
    pub(crate) const ALL: [Self; G_GROUPS] = [
        Self::NonModal,
        Self::Motion,
        Self::Plane,
        Self::Distance,
        Self::ArcCentre,
        Self::FeedMode,
        Self::Units,
        Self::Compensation,
        Self::ToolLength,
        Self::Retract,
        Self::System,
        Self::Path,
        Self::Spindle,
        Self::Lathe,
        Self::G92,
    ];

    pub(crate) const fn name(self) -> &'static str {
        match self {
            Self::NonModal => "group 0, non-modal",
            Self::Motion => "group 1, motion",
            Self::Plane => "group 2, plane",
            Self::Distance => "group 3, distance",
            Self::ArcCentre => "group 4, arc centre",
            Self::FeedMode => "group 5, feed mode",
            Self::Units => "group 6, units",
            Self::Compensation => "group 7, cutter compensation",
            Self::ToolLength => "group 8, tool length",
            Self::Retract => "group 10, retract",
            Self::System => "group 12, coordinate system",
            Self::Path => "group 13, path",
            Self::Spindle => "group 14, spindle",
            Self::Lathe => "group 15, lathe",
            Self::G92 => "group 16, G92",
        }
    }
}

/// Modal group of an M code; also its place in a block.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub(crate) enum MGroup {
    Stop,
    Io,
    Tool,
    Spindle,
    Coolant,
    Override,
    User,
    Call,
}

/// M7 and M8 in one block, as the code of [`MGroup::Coolant`].
pub(crate) const MIST_AND_FLOOD: i16 = 78;

pub(crate) const M_GROUPS: usize = 8;

impl MGroup {
    pub(crate) const fn of(number: i32) -> Option<Self> {
        Some(match number {
            0 | 1 | 2 | 30 | 60 | 99 => Self::Stop,
            62..=68 => Self::Io,
            6 | 61 => Self::Tool,
            3 | 4 | 5 | 19 | 70..=73 => Self::Spindle,
            7..=9 => Self::Coolant,
            48..=53 => Self::Override,
            98 => Self::Call,
            100..=199 => Self::User,
            _ => return None,
        })
    }

    /// LinuxCNC's groups 4 to 10, in which free codes may be executed.
    #[cfg(feature = "alloc")]
    pub(crate) const REMAPPED: [Self; 7] =
        [Self::Stop, Self::Io, Self::Tool, Self::Spindle, Self::Coolant, Self::Override, Self::User];

    /// The step in which a block executes the group (dialect section 7).
    #[cfg(feature = "alloc")]
    pub(crate) const fn step(self) -> u8 {
        match self {
            Self::Io => 7,
            Self::Tool => 8,
            Self::Spindle => 9,
            Self::Coolant => 10,
            Self::Override => 11,
            Self::User => 12,
            Self::Stop | Self::Call => 27,
        }
    }

    pub(crate) const fn name(self) -> &'static str {
        match self {
            Self::Stop => "group 4, stopping",
            Self::Io => "group 5, inputs and outputs",
            Self::Tool => "group 6, tool change",
            Self::Spindle => "group 7, spindle",
            Self::Coolant => "group 8, coolant",
            Self::Override => "group 9, overrides",
            Self::User => "group 10, user defined",
            Self::Call => "program call",
        }
    }
}

/// How F is meant.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum FeedMode {
    /// G93.
    InverseTime,
    /// G94.
    PerMinute,
    /// G95.
    PerTurn,
}

/// Cutter compensation side.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Side {
    Left,
    Right,
}

/// One spindle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Spindle {
    pub(crate) speed: f64,
    pub(crate) turning: Option<Direction>,
    /// rpm limit of constant surface speed; `None` = G97.
    pub(crate) surface_speed: Option<f64>,
    pub(crate) speed_override: bool,
}

/// Everything a program sets and that stays until set again.
#[derive(Debug, Clone)]
pub(crate) struct Modal {
    /// [`G80`] = none.
    pub(crate) motion: GCode,
    pub(crate) plane: Plane,
    pub(crate) incremental: bool,
    pub(crate) arc_centre_absolute: bool,
    pub(crate) feed_mode: FeedMode,
    pub(crate) units: LengthUnit,
    pub(crate) compensation: Option<Side>,
    pub(crate) retract_to_old: bool,
    /// 1 = G54 to 9 = G59.3.
    pub(crate) system: i32,
    pub(crate) path: MotionControlMode,
    pub(crate) naivecam_tolerance: f64,
    pub(crate) diameter: bool,
    pub(crate) feed: f64,
    pub(crate) spindles: [Spindle; 8],
    /// Slot of the tool chosen by T; -1 = none yet.
    pub(crate) selected_slot: i32,
    pub(crate) selected_tool: i32,
    /// G43: the offset is that of the tool in the spindle.
    pub(crate) follows_tool: bool,
    pub(crate) mist: bool,
    pub(crate) flood: bool,
    pub(crate) feed_override: bool,
    pub(crate) adaptive_feed: bool,
    pub(crate) feed_hold: bool,
}

impl Modal {
    pub(crate) fn new(units: LengthUnit) -> Self {
        let spindle = Spindle { speed: 0.0, turning: None, surface_speed: None, speed_override: true };
        Self {
            motion: G80,
            plane: Plane::Xy,
            incremental: false,
            arc_centre_absolute: false,
            feed_mode: FeedMode::PerMinute,
            units,
            compensation: None,
            retract_to_old: false,
            system: 1,
            path: MotionControlMode::Continuous { tolerance: 0.0 },
            naivecam_tolerance: 0.0,
            diameter: false,
            feed: 0.0,
            spindles: [spindle; 8],
            selected_slot: -1,
            selected_tool: 0,
            follows_tool: false,
            mist: false,
            flood: false,
            feed_override: true,
            adaptive_feed: false,
            feed_hold: true,
        }
    }
}
