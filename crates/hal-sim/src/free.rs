//! One joint on its own, from where it is to a target within velocity and acceleration limits: homing, jogging.
//!
//! In each period it takes the largest speed from which it can still stop at the target:
//! v = −aT + √(2a|e| + (aT)²), e the way left, T the period; so n more periods of braking by aT each cover at most e.

use pkm_kins::maths::sqrt;

/// A joint that moves freely.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Free {
    /// mm or rad
    position: f64,
    /// Travel in the last period, mm or rad.
    travel: f64,
    target: f64,
    /// mm or rad a period.
    top: f64,
    /// mm or rad a period, each period.
    change: f64,
}

impl Free {
    /// At rest.
    pub const fn new(position: f64) -> Self {
        Self { position, travel: 0.0, target: position, top: 0.0, change: f64::INFINITY }
    }

    /// Goes to `target` with at most `velocity` (mm/s or rad/s, above 0) and `acceleration`; `period_s` as in [`Self::tick`].
    pub fn go(&mut self, target: f64, velocity: f64, acceleration: f64, period_s: f64) {
        self.target = target;
        self.top = velocity * period_s;
        self.change = acceleration * (period_s * period_s);
    }

    /// Brakes to rest.
    pub fn stop(&mut self) {
        self.top = 0.0;
    }

    /// One period: the new position.
    pub fn tick(&mut self) -> f64 {
        let left = self.target - self.position;
        let tiny = self.change * 0.001;
        let wanted = if left.abs() > tiny {
            let fastest = sqrt(2.0 * self.change * left.abs() + self.change * self.change) - self.change;
            fastest.min(self.top).copysign(left)
        } else {
            0.0
        };
        let travel = wanted.min(self.travel + self.change).max(self.travel - self.change);
        if left.abs() <= tiny && travel == 0.0 && self.top > 0.0 {
            self.position = self.target;
        }
        self.position += travel;
        self.travel = travel;
        self.position
    }

    /// mm or rad
    pub const fn position(&self) -> f64 {
        self.position
    }

    /// Travel in the last period, mm or rad.
    pub const fn travel(&self) -> f64 {
        self.travel
    }

    /// At rest at the target, or stopped.
    pub fn is_done(&self) -> bool {
        self.travel == 0.0 && (self.top == 0.0 || self.position == self.target)
    }

    /// The zero is from now on where `shift` was.
    pub fn shift(&mut self, shift: f64) {
        self.position -= shift;
        self.target -= shift;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const T: f64 = 0.001;

    #[test]
    fn it_arrives_within_its_limits_and_without_overshoot() {
        for (target, velocity, acceleration) in [
            (10.0, 20.0, 500.0),
            (-0.003, 5.0, 100.0),
            (1.5, 1e6, 1000.0),
            (1e-9, 1.0, 1.0),
            (-80.0, 1.0, 1e6),
        ] {
            let mut free = Free::new(0.0);
            free.go(target, velocity, acceleration, T);
            let (mut last, mut ticks) = (0.0_f64, 0);
            while !free.is_done() {
                let before = free.position();
                let at = free.tick();
                assert!((at - before - last).abs() <= acceleration * T * T * (1.0 + 1e-9) + 1e-12);
                assert!((at - before).abs() <= velocity * T + 1e-12, "{target}");
                assert!(at * target >= 0.0 && at.abs() <= target.abs() + 1e-12, "{target}: {at}");
                last = at - before;
                ticks += 1;
                assert!(ticks < 1_000_000, "{target} is not reached");
            }
            assert_eq!(free.position(), target);
            let least_s = (target.abs() / velocity).max(2.0 * (target.abs() / acceleration).sqrt());
            assert!(f64::from(ticks) * T < least_s * 1.2 + 0.1, "{target}: {ticks} periods, {least_s} s");
        }
    }

    #[test]
    fn stopping_takes_no_longer_than_the_limit_wants() {
        let mut free = Free::new(0.0);
        free.go(100.0, 50.0, 1000.0, T);
        for _ in 0..200 {
            free.tick();
        }
        let (from, speed) = (free.position(), free.travel() / T);
        free.stop();
        let ticks = (1..1000).find(|_| {
            free.tick();
            free.is_done()
        });
        assert_eq!(ticks, Some(50));
        assert!(free.position() - from <= speed * speed / 2000.0, "{}", free.position() - from);
    }
}
