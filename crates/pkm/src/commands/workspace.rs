//! `pkm workspace`: what a machine can reach, as numbers, tables and pictures.

use crate::cli::{Format, Workspace};
use crate::outcome::{Failure, Outcome};
use crate::output::{self, Folder, Pending};
use crate::render::diagnostics::{self, Messages};
use pkm_analysis::figure::png::png;
use pkm_analysis::parallel;
use pkm_analysis::workspace::report::{Answer, Question, SCHEMA, Summary, answer};
use pkm_analysis::workspace::{Section, WorkspaceError};
use pkm_canon::diagnostic::Diagnostic;
use pkm_machine::Machine;
use serde::Serialize;
use std::io::{self, Write, stdout};

/// Pixels of a PNG per pixel of the SVG.
pub(crate) const PNG_SCALE: f32 = 1.5;

pub(crate) fn run(arguments: &Workspace, messages: &Messages) -> Result<Outcome, Failure> {
    match (work(arguments, messages), arguments.format) {
        (Err(Failure::CouldNot(diagnostics)), Format::Json) => {
            refuse(arguments, &diagnostics)?;
            Ok(Outcome::CouldNot)
        }
        (outcome, _) => outcome,
    }
}

fn work(arguments: &Workspace, messages: &Messages) -> Result<Outcome, Failure> {
    let machine = Machine::load(&arguments.machine.machine, &arguments.machine.set)?;
    let question = Question {
        resolution_mm: arguments.resolution,
        section: Section { z_mm: arguments.z, tilt_deg: [arguments.tilt_x, arguments.tilt_y] },
        threads: parallel::cores(),
    };
    let answer = match answer(&machine, &question) {
        Ok(answer) => answer,
        Err(error) => {
            let failure =
                Failure::could_not(code(&error), &arguments.machine.machine, error.to_string(), help(&error));
            // The question was good; the answer is: nothing.
            return match (error, failure) {
                (WorkspaceError::Empty { .. }, Failure::CouldNot(diagnostics)) => {
                    match arguments.format {
                        Format::Json => refuse(arguments, &diagnostics)?,
                        Format::Text => messages.print(&diagnostics),
                    }
                    Ok(Outcome::No)
                }
                (_, failure) => Err(failure),
            };
        }
    };
    save(arguments, &answer)?;
    match arguments.format {
        Format::Json => output::json_line(&answer.summary)?,
        Format::Text => text(&mut stdout().lock(), &answer.summary)?,
    }
    Ok(Outcome::Clean)
}

/// The answer in JSON when there is no workspace to show.
#[derive(Serialize)]
struct Refused<'a> {
    schema: u32,
    machine: &'a str,
    diagnostics: Vec<diagnostics::Json<'a>>,
}

fn refuse(arguments: &Workspace, diagnostics: &[Diagnostic]) -> Result<(), Failure> {
    let refused = Refused {
        schema: SCHEMA,
        machine: &arguments.machine.machine,
        diagnostics: diagnostics.iter().map(diagnostics::Json::from).collect(),
    };
    output::json_line(&refused)
}

fn code(error: &WorkspaceError) -> &'static str {
    match error {
        WorkspaceError::Empty { .. } => "workspace-empty",
        WorkspaceError::Resolution { .. } | WorkspaceError::TooFine { .. } => "workspace-resolution",
        WorkspaceError::Section { .. } => "workspace-section",
        WorkspaceError::Unsupported { .. } => "workspace-unsupported",
    }
}

fn help(error: &WorkspaceError) -> &'static str {
    match error {
        WorkspaceError::Empty { .. } => {
            "compare travel, link lengths, working_mode and assembly in the machine file"
        }
        WorkspaceError::Resolution { .. } | WorkspaceError::TooFine { .. } => {
            "--resolution is a distance in mm; without it one that fits the machine is chosen"
        }
        WorkspaceError::Section { .. } => {
            "choose --z within the table's travel, --tilt-x and --tilt-y in degrees"
        }
        WorkspaceError::Unsupported { .. } => "",
    }
}

/// All files at once: old ones stay if one cannot be written.
fn save(arguments: &Workspace, answer: &Answer) -> Result<(), Failure> {
    let folder = Folder::new(&arguments.out)?;
    let svg = answer.svg();
    let mut table = Vec::new();
    answer.csv(&mut table)?;
    let mut files = vec![
        ("workspace.svg".to_owned(), svg.clone().into_bytes()),
        ("workspace.png".to_owned(), raster(&svg)?),
        ("workspace.csv".to_owned(), table),
        ("workspace.json".to_owned(), format!("{}\n", output::json(&answer.summary)?).into_bytes()),
    ];
    files.extend(answer.objects().into_iter().map(|(name, text)| (name, text.into_bytes())));
    write_all(folder, &files)
}

/// A picture as PNG.
pub(crate) fn raster(svg: &str) -> Result<Vec<u8>, Failure> {
    png(svg, PNG_SCALE).map_err(|error| Failure::could_not("picture", "workspace.png", error, ""))
}

/// Writes files into a folder, all or none.
pub(crate) fn write_all(folder: Folder, files: &[(String, Vec<u8>)]) -> Result<(), Failure> {
    let mut done: Vec<Pending> = Vec::new();
    for (name, bytes) in files {
        let mut file = folder.create(name)?;
        file.write_all(bytes).map_err(|error| folder.failure(name, &error))?;
        done.push(file);
    }
    folder.commit(done)
}

fn text(out: &mut impl Write, summary: &Summary) -> io::Result<()> {
    writeln!(out, "{} ({})", summary.machine, summary.mechanism)?;
    for view in &summary.views {
        let [right, up] = &view.axes;
        writeln!(out, "  {} ({right} {up})", view.name)?;
        writeln!(out, "    reachable {:14.4} mm² ± {:.4}", view.area_mm2, view.area_error_bound_mm2)?;
        writeln!(
            out,
            "    usable    {:14.4} mm² ± {:.4}",
            view.usable_area_mm2, view.usable_area_error_bound_mm2
        )?;
        let bound = |value: Option<f64>| value.map_or("no bound".to_owned(), |value| fixed(value, 4));
        writeln!(out, "    det K from {} to {}", bound(view.det_k[0]), bound(view.det_k[1]))?;
        let singular = |within: bool| if within { "within" } else { "not within" };
        writeln!(
            out,
            "    type 1 {} the stroke, type 2 {}",
            singular(view.type_1_in_stroke),
            singular(view.type_2_in_stroke)
        )?;
    }
    for (name, volume) in &summary.volume_mm3 {
        let bound = summary.volume_error_bound_mm3.get(name).copied().unwrap_or(0.0);
        write!(out, "  volume {name}: {volume:.0} mm³ ± {bound:.0}")?;
        match summary.volume_step_estimate_mm3.get(name) {
            Some(estimate) => writeln!(out, " at these steps; the steps leave about {estimate:.0}")?,
            None => writeln!(out)?,
        }
    }
    for solid in &summary.solids {
        let [low, high] = solid.planes_mm;
        let (radius, singularity) = (solid.largest_radius_mm, solid.sampled_singularity);
        writeln!(
            out,
            "  {}: planes {low} to {high} mm, largest radius {radius:.2} mm, smallest |σ| seen {singularity:.3}",
            solid.name
        )?;
    }
    for (axis, [low, high]) in &summary.bounding_box_mm {
        writeln!(out, "  {axis} from {} to {} mm", fixed(*low, 3), fixed(*high, 3))?;
    }
    Ok(())
}

/// With so many decimals; what rounds to 0 has no sign.
fn fixed(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$}");
    match text.strip_prefix('-') {
        Some(digits) if digits.bytes().all(|byte| matches!(byte, b'0' | b'.')) => digits.to_owned(),
        _ => text,
    }
}

#[cfg(test)]
mod tests {
    use super::fixed;

    #[test]
    fn zero_has_no_sign() {
        assert_eq!(fixed(-7.7e-16, 4), "0.0000");
        assert_eq!(fixed(-0.0001, 4), "-0.0001");
        assert_eq!(fixed(-20.0, 3), "-20.000");
    }
}
