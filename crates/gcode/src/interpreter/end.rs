//! M2, M30 and M99 at the main level: back to the start state.

use super::{Out, state::State};
use crate::modal::{FeedMode, G1};
use crate::parameters;
use crate::settings::Dialect;
use pkm_canon::{Canon, Plane};

impl State {
    /// Ends the program; units, path mode, retract mode, tool offset and arc mode stay (dialect section 15).
    pub(crate) fn end_program(&mut self, number: i32, out: &mut Out<'_>) {
        let machine = self.machine_point(self.position);
        if !(self.settings.keeps_system_at_end && self.settings.is_newer()) {
            self.load_system(1);
            self.parameters.set(parameters::SYSTEM, 1.0);
        }
        self.position = self.program_point(machine);
        out.emit(self.g5x_command());
        out.emit(Canon::SetXyRotation(self.rotation_deg));
        if self.modal.plane != Plane::Xy {
            self.modal.plane = Plane::Xy;
            out.emit(Canon::SelectPlane(Plane::Xy));
        }
        self.modal.incremental = false;
        self.modal.feed_mode = FeedMode::PerMinute;
        self.modal.feed = 0.0;
        out.emit(Canon::SetFeedMode { spindle: 0, mode: 0 });
        out.emit(Canon::SetFeedRate(0.0));
        if !self.modal.feed_override {
            self.set_feed_override(true, out);
        }
        self.modal.compensation = None;
        for spindle in 0..self.settings.spindles.min(8) {
            let n = i32::from(spindle);
            self.modal.spindles[usize::from(spindle)].turning = None;
            self.modal.spindles[usize::from(spindle)].surface_speed = None;
            out.emit(Canon::StopSpindle { spindle: n });
            if !self.modal.spindles[usize::from(spindle)].speed_override {
                self.modal.spindles[usize::from(spindle)].speed_override = true;
                // LinuxCNC switches it on without saying so.
                if self.settings.dialect == Dialect::Pkm {
                    out.emit(Canon::SpeedOverride { spindle: n, on: true });
                }
            }
            out.emit(Canon::SetSpindleMode { spindle: n, css_limit: 0.0 });
        }
        self.modal.motion = G1;
        if self.modal.mist {
            self.modal.mist = false;
            out.emit(Canon::Mist(false));
        }
        if self.modal.flood {
            self.modal.flood = false;
            out.emit(Canon::Flood(false));
        }
        if self.settings.forgets_g92_at_end && self.settings.is_newer() {
            self.keep_machine_point(|state| state.g92 = [0.0; 9]);
            self.parameters.set(parameters::G92_APPLIED, 0.0);
            out.emit(self.g92_command());
        }
        if number == 30 {
            out.emit(Canon::PalletShuttle);
        }
        out.emit(Canon::ProgramEnd);
    }
}
