//! What a simulated machine tells: after each period, and in all.

use crate::component::{Feedback, Setpoint};
use crate::components::driver::Violations;
use pkm_stepgen::Edge;

/// A joint at the end of a period.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct JointState {
    /// Commanded, mm or rad.
    pub commanded: f64,
    /// Counted from the edges, mm or rad.
    pub position: f64,
    /// Counted from the edges, steps; 0 is the joint's zero.
    pub count: i64,
    /// `count` less the commanded position, steps.
    pub step_error: f64,
}

/// The machine at the end of a period.
#[derive(Debug, Clone, Copy)]
pub struct TickReport<'a> {
    /// Number of the period; 0 is the start.
    pub tick: u64,
    /// tick × servo period.
    pub time_ns: u64,
    /// What was commanded for this time.
    pub setpoint: &'a Setpoint,
    /// In joint order.
    pub joints: &'a [JointState],
    /// What spindle and probe tell.
    pub feedback: Feedback,
}

/// Sees everything that the machine does: for each period first its edges in order of time, then the report.
pub trait Observer {
    /// False: edges are not wanted. They come all the same if another observer wants them.
    fn wants_edges(&self) -> bool {
        true
    }

    /// An edge on one of the lines to the drivers.
    fn edge(&mut self, edge: &Edge);

    /// The end of a period.
    fn tick(&mut self, report: &TickReport<'_>);
}

/// Nobody looks on.
impl Observer for () {
    fn wants_edges(&self) -> bool {
        false
    }
    fn edge(&mut self, _: &Edge) {}
    fn tick(&mut self, _: &TickReport<'_>) {}
}

/// What a joint did so far.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct JointStatistics {
    /// Steps in either direction.
    pub steps: u64,
    /// Changes of the direction line.
    pub reversals: u64,
    /// Shortest time between two steps, ns; None before the second step.
    pub min_pulse_interval_ns: Option<u64>,
    /// Largest |count − commanded| at the ends of periods, steps.
    pub max_step_error: f64,
    /// Largest |count − commanded| just before and after each step, steps.
    pub max_edge_error: f64,
    /// Steps that came later than wanted, for the driver's timing.
    pub delayed_steps: u64,
    /// The largest such delay, ns.
    pub max_delay_ns: u64,
    /// Times shorter than the driver's data sheet allows.
    pub violations: Violations,
    /// Lowest position counted from the edges at the ends of periods, mm or rad.
    pub min_position: f64,
    /// Highest such position, mm or rad.
    pub max_position: f64,
}
