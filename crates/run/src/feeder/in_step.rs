//! What the controller does in step with the spindle, with the probe, and with the spindle itself.

use super::*;

impl Feeder<'_> {
    /// What follows does not belong to the chain.
    pub(super) fn close_chain(&mut self) {
        self.planner.finish();
        self.pending = Some(Pending::Chain(std::mem::take(&mut self.chain), None));
    }

    pub(super) fn begin_chain(
        &mut self,
        mut moves: Vec<SynchronisedMove>,
        retract_scale: Option<f64>,
    ) -> Result<(), Diagnostic> {
        if let Some((_, last)) = self.orders.drain(..).next_back() {
            self.spindle = last;
        }
        for step in &mut moves {
            // A move of no length is only counted by the planner; its number is the chain's.
            let still = Move {
                geometry: Geometry::Hold(step.geometry.at(0.0).position),
                feed: Feed { speed: f64::INFINITY, group: FeedGroup::Xyz },
                rapid: true,
                mode: PathMode::ExactStop,
                span: step.span,
            };
            step.motion = self.planner.push(still).map_err(|error| self.refused(&error))?;
            self.moves = step.motion.wrapping_add(1);
            self.path_length_mm += step.geometry.length();
            self.programmed.push(step.motion, step.geometry, &[]);
        }
        self.in_step = Some(SynchronisedDrive::new(
            self.program,
            self.machine,
            &self.limits,
            &self.mechanism,
            &moves,
            retract_scale,
            (self.spindle, self.substeps),
        )?);
        Ok(())
    }

    /// A chain is over: the planner goes on from its end.
    pub(super) fn end_chain(&mut self) -> Result<(), Diagnostic> {
        let Some(drive) = self.in_step.take_if(|drive| drive.is_over()) else { return Ok(()) };
        *if drive.is_tap() { &mut self.chains.taps } else { &mut self.chains.threads } += 1;
        if drive.was_never_in_step() {
            self.chains.warnings.push(messages::never_in_step(self.program, drive.span));
        }
        let (mechanism, pose) = (self.mechanism, self.setpoint.pose);
        self.planner.switch(mechanism, pose, drive.span).map_err(|error| self.refused(&error))
    }

    /// The probe has met something: braking begins. The place is that of the period at whose end it answered.
    pub(super) fn watch_probe(&mut self) {
        let Some(probing) = &mut self.probing else { return };
        if probing.tripped.is_none() && self.fresh && self.feedback.probe != probing.probe.away {
            probing.tripped = Some(self.setpoint.pose);
            self.planner.abort();
        }
    }

    /// A probing move has come to rest: the interpreter is told.
    pub(super) fn conclude_probing(&mut self) {
        self.watch_probe();
        if !self.fresh || !self.planner.is_idle() || !self.given.is_multiple_of(self.substeps.into()) {
            return;
        }
        let Some(Probing { probe, span, tripped }) = self.probing.take() else { return };
        let rests = self.planner.setpoint().pose;
        if tripped.is_none() && probe.must_trip {
            let failure = messages::probe_no_contact(self.program, self.machine, span, probe.away, &rests);
            self.fail(failure);
            return;
        }
        tell_probe(&mut self.interpreter, &tripped.unwrap_or(rests), tripped.is_some());
        self.frame.set_position(rests.to_array());
    }

    /// The spindle is told what comes with the move that has begun.
    pub(super) fn order_spindle(&mut self) {
        let now = self.planner.setpoint();
        let begun = if now.state == State::Dwell { now.motion.wrapping_add(1) } else { now.motion };
        let idle = self.planner.is_idle();
        while let Some(&(motion, order)) = self.orders.front()
            && (idle || motion <= begun)
        {
            self.spindle = order;
            self.orders.pop_front();
        }
        if self.spindle.on {
            self.orient = None;
        }
    }

    /// M19: waits for the angle.
    pub(super) fn wait_for_angle(&mut self) -> Result<(), Diagnostic> {
        let Some((span, waited)) = &mut self.orienting else { return Ok(()) };
        if *waited > u64::from(self.substeps) && self.feedback.spindle.is_oriented {
            self.orienting = None;
            return Ok(());
        }
        *waited += 1;
        let timeout_s = self.machine.spindle.timeout_s;
        let most = timeout_s * 1e9 / self.machine.servo_period_ns as f64 * f64::from(self.substeps);
        if *waited as f64 > most {
            return Err(messages::orient_timeout(self.program, *span, timeout_s));
        }
        Ok(())
    }

    pub(super) fn spindle_command(&self) -> SpindleCommand {
        match &self.in_step {
            Some(drive) => drive.command(),
            None => SpindleCommand {
                on: self.spindle.on,
                speed_rpm: self.spindle.speed_rpm,
                orient: self.orient,
                index_enable: false,
            },
        }
    }
}
