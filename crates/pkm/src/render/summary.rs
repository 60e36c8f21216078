//! The summary of a run, for scripts and for people.

use crate::outcome::Failure;
use crate::output;
use crate::render::diagnostics;
use comfy_table::{CellAlignment, ContentArrangement, Table, presets};
use pkm_run::Summary;
use serde::Serialize;
use std::fmt::Write as _;

/// The summary with its diagnostics.
#[derive(Serialize)]
struct Json<'a> {
    #[serde(flatten)]
    summary: &'a Summary,
    diagnostics: Vec<diagnostics::Json<'a>>,
}

/// One JSON object.
pub(crate) fn json(summary: &Summary) -> Result<String, Failure> {
    let diagnostics = summary.diagnostics.iter().map(diagnostics::Json::from).collect();
    output::json(&Json { summary, diagnostics })
}

/// Some lines and a table.
pub(crate) fn text(summary: &Summary) -> String {
    let mut text = String::new();
    let verdict = match (summary.completed, summary.servo_ticks) {
        (true, 0) => "completed, nothing moved",
        (true, _) => "completed",
        (false, 0) => "NOT completed, nothing moved",
        (false, _) => "NOT completed",
    };
    let _ = writeln!(text, "{} on {}: {verdict}", summary.program, summary.machine);
    if summary.servo_ticks == 0 {
        return text;
    }
    let _ = writeln!(
        text,
        "  {} blocks, {:.3} s, {:.3} mm of path, {} servo periods",
        summary.blocks, summary.duration_s, summary.path_length_mm, summary.servo_ticks
    );
    let _ = writeln!(
        text,
        "  path deviation {:.6} mm (half a step of every joint reaches {:.6} mm), step error {:.4} steps",
        summary.max_path_deviation_mm, summary.half_step_reach_mm, summary.max_step_error_steps
    );
    let _ = writeln!(
        text,
        "  nearest to a singularity {:.4} (line {}, joint {}), driver timing violations {}",
        summary.min_singularity_distance,
        summary.closest_approach.line,
        summary.closest_approach.joint,
        summary.driver_timing_violations
    );
    if let Some(in_step) = &summary.synchronisation {
        let _ = writeln!(
            text,
            "  in step with the spindle: {} threads, {} taps, {} servo periods, at most {:.3e} mm off",
            in_step.threads, in_step.taps, in_step.ticks_in_step, in_step.max_error_mm
        );
    }
    if summary.starved_stops > 0 {
        let _ = writeln!(text, "  {} stops for want of the next block", summary.starved_stops);
    }
    let mut table = Table::new();
    table.load_style(presets::NOTHING).set_content_arrangement(ContentArrangement::Disabled);
    table.set_header([
        "joint",
        "min",
        "max",
        "velocity",
        "limit",
        "acceleration",
        "limit",
        "steps",
        "shortest pulse interval",
    ]);
    for joint in &summary.joints {
        table.add_row([
            joint.name.clone(),
            format!("{:.3}", joint.min),
            format!("{:.3}", joint.max),
            format!("{:.3}", joint.peak_velocity),
            format!("{}", joint.velocity_limit),
            format!("{:.2}", joint.peak_acceleration),
            format!("{}", joint.acceleration_limit),
            joint.steps.to_string(),
            format!("{} ns", joint.min_pulse_interval_ns),
        ]);
    }
    for column in table.column_iter_mut().skip(1) {
        column.set_cell_alignment(CellAlignment::Right);
    }
    for line in table.lines() {
        let _ = writeln!(text, " {}", line.trim_end());
    }
    text
}
