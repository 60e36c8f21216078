//! `pkm linuxcnc`: a complete LinuxCNC configuration for a machine.

use crate::cli::Linuxcnc;
use crate::outcome::{Failure, Outcome, warning};
use crate::output::{Folder, failure};
use crate::render::diagnostics::Messages;
use pkm_linuxcnc::Module;
use pkm_machine::{Machine, MachineFile};
use std::io::Write;
use std::path::{Path, PathBuf};

/// Builds the modules; also in the configuration's README.
const BUILD: &str = "cargo build --profile linuxcnc --package pkm-linuxcnc-kins --examples";

pub(crate) fn run(arguments: &Linuxcnc, messages: &Messages) -> Result<Outcome, Failure> {
    let name = &arguments.machine.machine;
    let file = MachineFile::parse(name, &pkm_machine::read(name)?, &arguments.machine.set)?;
    if !arguments.machine.set.is_empty() {
        // The folder keeps the machine file, and its numbers must be those of the configuration.
        let message = "--set changes a machine for one run; a configuration stays".to_owned();
        return Err(Failure::could_not(
            "linuxcnc-set",
            name,
            message,
            "write the change into the machine file",
        ));
    }
    let machine = Machine::try_from(file.clone())?;
    let configuration = pkm_linuxcnc::configuration(&file, &machine);
    let folder = Folder::new(&arguments.out)?;
    let mut pending = Vec::new();
    for (name, text) in &configuration.files {
        if let Some(inner) = Path::new(name).parent().filter(|inner| !inner.as_os_str().is_empty()) {
            let path = arguments.out.join(inner);
            std::fs::create_dir_all(&path).map_err(|error| failure(&path, &error))?;
        }
        let mut file = folder.create(name)?;
        file.write_all(text.as_bytes()).map_err(|error| folder.failure(name, &error))?;
        pending.push(file);
    }
    let mut built = None;
    if let Some(module) = configuration.module {
        built = match &arguments.module {
            Some(path) => Some(path.clone()),
            None => built_module(module),
        };
        if let Some(path) = &built {
            let bytes = std::fs::read(path).map_err(|error| {
                let message = format!("cannot read the module {}: {error}", path.display());
                Failure::could_not("linuxcnc-module", &path.display().to_string(), message, BUILD)
            })?;
            let name = format!("{}.so", module.name);
            let mut file = folder.create(&name)?;
            file.write_all(&bytes).map_err(|error| folder.failure(&name, &error))?;
            pending.push(file);
        }
    }
    folder.commit(pending)?;
    let mut out = std::io::stdout().lock();
    for (name, _) in &configuration.files {
        writeln!(out, "{}", arguments.out.join(name).display())?;
    }
    match (configuration.module, built) {
        (Some(module), Some(_)) => {
            let so = arguments.out.join(format!("{}.so", module.name));
            writeln!(out, "{}", so.display())?;
        }
        (Some(module), None) => {
            let message =
                format!("the kinematics module {} is not built yet, the rest is complete", module.name);
            let help =
                format!("in the pkm repository: {BUILD}; then this command again, or as README.md says");
            let folder = arguments.out.display().to_string();
            messages.print(&[warning("linuxcnc-module", &folder, message, &help)]);
        }
        (None, _) => {}
    }
    Ok(Outcome::Clean)
}

/// Where cargo leaves the module: beside the profile that this program was built in.
fn built_module(module: Module) -> Option<PathBuf> {
    let exe = std::env::current_exe().ok()?;
    let path = exe.parent()?.parent()?.join(format!("linuxcnc/examples/lib{}.so", module.name));
    path.is_file().then_some(path)
}
