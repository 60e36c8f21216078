//! Which configuration of a reconfigurable machine runs a program, and which does it best.
//!
//! Every configuration is checked and planned by itself, on all cores; the answer does not depend on how many there are.

use crate::plan::planned;
use crate::{Options, Program};
use pkm_analysis::parallel;
use pkm_canon::diagnostic::{Diagnostic, Severity};
use pkm_kins::JointKind;
use pkm_machine::family::{Configuration, Family};
use serde::Serialize;
use std::cmp::Ordering;

/// What is best.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Rank {
    /// The shortest time; then the farthest from singularities, then the shortest travel.
    Time,
    /// The farthest from singularities; then the shortest time.
    Singularity,
    /// The shortest travel of the drive that needs most; then the shortest time.
    Travel,
}

/// One configuration with what became of it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Judged {
    /// "drives P, links 195"
    pub name: String,
    /// What `--set` takes to make it.
    pub set: Vec<String>,
    /// Runs, or why not.
    #[serde(flatten)]
    pub verdict: Verdict,
}

/// What became of a configuration.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(rename_all = "kebab-case", tag = "verdict")]
pub enum Verdict {
    /// It runs the program.
    Runs(Figures),
    /// A block defeats it.
    Fails {
        /// The first line that cannot be run; 0 if it is not a line (the start).
        line: u32,
        /// Code of the finding.
        code: String,
        /// The finding.
        message: String,
    },
    /// The parameters make no machine.
    NoMachine {
        /// Code of the first finding.
        code: String,
        /// The finding.
        message: String,
    },
}

/// How a configuration runs a program.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Figures {
    /// From the first motion to rest after the last.
    pub duration_s: f64,
    /// Smallest singularity measure on the way, 0 to 1.
    pub min_singularity_distance: f64,
    /// The longest stroke that a linear joint needs, mm.
    pub travel_mm: f64,
    /// Lowest and highest position of every joint, mm or degrees.
    pub joints: Vec<crate::JointUse>,
}

/// The outcome of a search.
#[derive(Debug, Clone, PartialEq)]
pub struct Found {
    /// All configurations: those that run, best first; then the others in the family's order. Those that were not reached
    /// when the search was ended are missing.
    pub configurations: Vec<Judged>,
    /// How many run.
    pub runs: usize,
    /// Nothing moves in any that runs.
    pub still: bool,
    /// The search was ended early.
    pub ended: bool,
}

/// Tries every configuration. `progress` is called after each, from any thread; the search ends early when it answers false.
///
/// # Errors
/// The program cannot be read.
pub fn search(
    family: &Family,
    program: &Program,
    options: &Options,
    rank: Rank,
    threads: usize,
    progress: &(dyn Fn() -> bool + Sync),
) -> Result<Found, Diagnostic> {
    let go_on = std::sync::atomic::AtomicBool::new(true);
    let judged = parallel::map(family.count(), threads, |number| {
        if !go_on.load(std::sync::atomic::Ordering::Relaxed) {
            return Ok(None);
        }
        let answer = judge(family, family.configuration(number), program, options);
        if !progress() {
            go_on.store(false, std::sync::atomic::Ordering::Relaxed);
        }
        answer.map(Some)
    });
    let all = judged.into_iter().collect::<Result<Vec<Option<Judged>>, Diagnostic>>()?;
    let ended = all.iter().any(Option::is_none);
    let mut configurations: Vec<Judged> = all.into_iter().flatten().collect();
    // A stable sort: equals stay in the family's order.
    configurations.sort_by(|a, b| match (&a.verdict, &b.verdict) {
        (Verdict::Runs(a), Verdict::Runs(b)) => rank.compare(a, b),
        (Verdict::Runs(_), _) => Ordering::Less,
        (_, Verdict::Runs(_)) => Ordering::Greater,
        _ => Ordering::Equal,
    });
    let figures = || {
        configurations.iter().filter_map(|judged| match &judged.verdict {
            Verdict::Runs(figures) => Some(figures),
            _ => None,
        })
    };
    let (runs, still) = (figures().count(), figures().all(|figures| figures.duration_s == 0.0));
    Ok(Found { runs, still: still && runs > 0, ended, configurations })
}

impl Rank {
    fn compare(self, a: &Figures, b: &Figures) -> Ordering {
        let time = a.duration_s.total_cmp(&b.duration_s);
        let singularity = b.min_singularity_distance.total_cmp(&a.min_singularity_distance);
        let travel = a.travel_mm.total_cmp(&b.travel_mm);
        match self {
            Self::Time => time.then(singularity).then(travel),
            Self::Singularity => singularity.then(time).then(travel),
            Self::Travel => travel.then(time).then(singularity),
        }
    }
}

fn judge(
    family: &Family,
    Configuration { name, set }: Configuration,
    program: &Program,
    options: &Options,
) -> Result<Judged, Diagnostic> {
    let machine = match family.machine(&Configuration { name: name.clone(), set: set.clone() }) {
        Ok(machine) => machine,
        Err(findings) => {
            let first = findings.into_iter().next();
            let (code, message) = first.map_or_else(Default::default, |d| (d.code.to_string(), d.message));
            return Ok(Judged { name, set, verdict: Verdict::NoMachine { code, message } });
        }
    };
    let plan = planned(program, &machine, options, false)?;
    let first = plan.diagnostics.iter().find(|finding| finding.severity == Severity::Error);
    let verdict = match first {
        Some(finding) => Verdict::Fails {
            line: finding.line,
            code: finding.code.to_string(),
            message: finding.message.clone(),
        },
        None if !plan.completed => Verdict::Fails {
            line: 0,
            code: "not-completed".to_owned(),
            message: "the program did not come to its end within the most servo periods".to_owned(),
        },
        None => {
            let linear =
                machine.joints.iter().zip(&plan.joints).filter(|(joint, _)| joint.kind == JointKind::Linear);
            let travel_mm = linear.fold(0.0, |most: f64, (_, used)| most.max(used.max - used.min));
            Verdict::Runs(Figures {
                duration_s: plan.duration_s,
                min_singularity_distance: plan.min_singularity_distance,
                travel_mm,
                joints: plan.joints,
            })
        }
    };
    Ok(Judged { name, set, verdict })
}
