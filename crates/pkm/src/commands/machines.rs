//! `pkm machines`: the machines that ship.

use crate::cli::{Format, Machines};
use crate::outcome::{Failure, Outcome};
use comfy_table::{ContentArrangement, Table, presets};
use pkm_kins::{Axis, Kinematics};
use pkm_machine::{Machine, shipped};
use serde::Serialize;
use std::io::{Write, stdout};

/// One row of the list.
#[derive(Serialize)]
struct Row {
    name: String,
    mechanism: String,
    axes: String,
    joints: Vec<String>,
    description: String,
    source: String,
}

pub(crate) fn run(arguments: &Machines) -> Result<Outcome, Failure> {
    let mut out = stdout().lock();
    if let Some(name) = &arguments.name {
        let Some(text) = shipped::text(name) else {
            let message = format!("no machine named `{name}` ships");
            return Err(Failure::could_not("machine-name", name, message, "`pkm machines` lists them"));
        };
        out.write_all(text.as_bytes())?;
        return Ok(Outcome::Clean);
    }
    let names = shipped::SHIPPED.iter().chain(shipped::FAMILIES).map(|(name, _)| row(name));
    let rows = names.collect::<Result<Vec<Row>, Failure>>()?;
    match arguments.format {
        Format::Json => {
            let list = serde_json::json!({ "schema": 1, "machines": rows });
            writeln!(out, "{list}")?;
        }
        Format::Text => {
            let mut table = Table::new();
            table.load_style(presets::NOTHING).set_content_arrangement(ContentArrangement::Disabled);
            table.set_header(["name", "mechanism", "axes", "joints", "description", "source"]);
            for row in &rows {
                let joints = row.joints.join(" ");
                table.add_row([&row.name, &row.mechanism, &row.axes, &joints, &row.description, &row.source]);
            }
            for line in table.lines() {
                writeln!(out, "{}", line.trim_end())?;
            }
            writeln!(out, "\n`pkm machines NAME` prints the annotated machine file.")?;
        }
    }
    Ok(Outcome::Clean)
}

fn row(name: &str) -> Result<Row, Failure> {
    let machine = Machine::load(name, &[])?;
    Ok(Row {
        name: name.to_owned(),
        mechanism: machine.mechanism_type.to_owned(),
        axes: machine.mechanism.axes().iter().map(Axis::letter).collect(),
        joints: machine.joints.into_iter().map(|joint| joint.name).collect(),
        description: machine.description,
        source: machine.source,
    })
}
