//! Limited jerk: a moving average over the last m setpoints of every joint.
//!
//! An average of admissible positions, velocities and accelerations is admissible, so every limit survives exactly;
//! the jerk becomes at most 2a / T_j with T_j = m servo periods, and a joint leaves its planned course by at most
//! a T_j² / 24 where its acceleration a is constant. Wherever the planner stops it waits for the average to arrive, so
//! stops are exact and take T_j longer.

use pkm_kins::{Joints, MAX_JOINTS};

/// The average of up to `M` setpoints.
#[derive(Debug, Clone)]
pub struct Smoother<const M: usize> {
    positions: [Joints; M],
    velocities: [Joints; M],
    length: usize,
    next: usize,
}

impl<const M: usize> Smoother<M> {
    /// Averages over `length` setpoints (clamped to 1 to `M`), at rest at `joints`.
    pub fn new(length: usize, joints: Joints) -> Self {
        Self {
            positions: [joints; M],
            velocities: [[0.0; MAX_JOINTS]; M],
            length: length.clamp(1, M.max(1)),
            next: 0,
        }
    }

    /// Takes the next setpoint (mm or rad, per second) and returns the averages.
    pub fn push(&mut self, position: &Joints, velocity: &Joints) -> (Joints, Joints) {
        if let (Some(p), Some(v)) = (self.positions.get_mut(self.next), self.velocities.get_mut(self.next)) {
            (*p, *v) = (*position, *velocity);
        }
        self.next = (self.next + 1) % self.length;
        let share = 1.0 / self.length as f64;
        let (mut off, mut speed) = ([0.0; MAX_JOINTS], [0.0; MAX_JOINTS]);
        for (p, v) in self.positions.iter().zip(&self.velocities).take(self.length) {
            // Differences from the newest: at rest the average is exact.
            for (((off, speed), (p, v)), now) in
                off.iter_mut().zip(&mut speed).zip(p.iter().zip(v)).zip(position)
            {
                *off += p - now;
                *speed += v;
            }
        }
        for ((off, speed), now) in off.iter_mut().zip(&mut speed).zip(position) {
            *off = now + *off * share;
            *speed *= share;
        }
        (off, speed)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn limits_survive_jerk_is_bounded_and_the_end_is_exact() {
        let (period, a, length) = (1e-3, 1000.0, 8_usize);
        let mut smoother = Smoother::<16>::new(length, [0.0; MAX_JOINTS]);
        let (mut q, mut v) = (0.0, 0.0);
        let mut trace = vec![0.0; 3];
        let mut worst_off = 0.0_f64;
        for tick in 0..200 + length {
            // Up, cruise, down.
            let acceleration = match tick {
                0..50 => a,
                150..200 => -a,
                _ => 0.0,
            };
            q += v * period + 0.5 * acceleration * period * period;
            v += acceleration * period;
            let mut joints = [0.0; MAX_JOINTS];
            let mut rates = [0.0; MAX_JOINTS];
            (joints[1], rates[1]) = (q, v);
            let (smooth, rate) = smoother.push(&joints, &rates);
            assert!(rate[1].abs() <= 50.0 + 1e-9);
            trace.push(smooth[1]);
            // Half the window late on average; the rest is the error of the path.
            if tick > 60 && tick < 140 {
                let late = (length - 1) as f64 / 2.0 * period * v;
                worst_off = worst_off.max((smooth[1] - (q - late)).abs());
            }
        }
        assert!(worst_off < 1e-9, "a constant speed is not disturbed: {worst_off}");
        assert_eq!(*trace.last().unwrap(), q, "at rest the average is the position itself");
        for w in trace.windows(4) {
            let acceleration = (w[2] - 2.0 * w[1] + w[0]) / (period * period);
            let jerk = (w[3] - 3.0 * w[2] + 3.0 * w[1] - w[0]) / (period * period * period);
            assert!(acceleration.abs() <= a * (1.0 + 1e-6), "{acceleration}");
            assert!(jerk.abs() <= 2.0 * a / (length as f64 * period), "{jerk}");
        }
    }
}
