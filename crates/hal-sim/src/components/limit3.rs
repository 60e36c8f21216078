//! `limit3`: out follows in, kept between min and max, with limited velocity and acceleration, and without overshoot.
//!
//! In each period the velocity may change by maxa × T. It is chosen as high as still lets `out` stop at the target: n
//! periods of braking from v take v T (n + 1)/2, so that for a distance d the largest velocity is
//! a T (−½ + √(¼ + 2 d/(a T²))), the continuous form of the discrete ramp.

use crate::block::{Block, BlockPins};
use crate::component::Tick;
use crate::hal_error::HalError;
use crate::values::{FloatPin, Values};
use pkm_kins::maths::sqrt;

/// See the module.
#[derive(Debug, Clone)]
pub struct Limit3 {
    input: FloatPin,
    min: FloatPin,
    max: FloatPin,
    maxv: FloatPin,
    maxa: FloatPin,
    out: FloatPin,
    velocity: f64,
}

impl Block for Limit3 {
    const NAME: &'static str = "limit3";

    fn new(pins: &mut BlockPins<'_>) -> Result<Self, HalError> {
        Ok(Self {
            input: pins.float_in("in", 0.0)?,
            min: pins.float_in("min", -1e20)?,
            max: pins.float_in("max", 1e20)?,
            maxv: pins.float_in("maxv", 1e20)?,
            maxa: pins.float_in("maxa", 1e20)?,
            out: pins.float_out("out")?,
            velocity: 0.0,
        })
    }

    fn update(&mut self, values: &mut Values, tick: &Tick<'_>) {
        let seconds = tick.period.seconds();
        let target = values.float(self.input).min(values.float(self.max)).max(values.float(self.min));
        let (max_v, change) = (values.float(self.maxv).abs(), values.float(self.maxa).abs() * seconds);
        let out = values.float(self.out);
        let distance = target - out;
        let ramp = if change > 0.0 {
            change * (sqrt(0.25 + 2.0 * distance.abs() / (change * seconds)) - 0.5)
        } else {
            0.0
        };
        // not beyond the target within this period
        let wanted = ramp.min(max_v).min(distance.abs() / seconds).copysign(distance);
        let velocity = wanted.min(self.velocity + change).max(self.velocity - change);
        self.velocity = velocity;
        // the last of the way in one piece: no creeping of rounding errors
        let arrived =
            velocity * seconds == distance || (velocity - distance / seconds).abs() <= 1e-9 * change;
        values.set_float(self.out, if arrived { target } else { out + velocity * seconds });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::block::load;
    use crate::hal::Hal;
    use crate::values::Value;

    #[test]
    fn it_arrives_within_its_limits_and_does_not_overshoot() {
        let mut hal = Hal::new(1000).unwrap();
        load::<Limit3>(&mut hal, &["limit3.0".to_owned()]).unwrap();
        hal.new_thread("t", 1_000_000).unwrap();
        hal.addf("limit3.0", "t").unwrap();
        let out = hal.float_pin("limit3.0.out").unwrap();
        for (pin, value) in [("maxv", 10.0), ("maxa", 100.0), ("max", 3.0)] {
            hal.setp(&format!("limit3.0.{pin}"), Value::Float(value)).unwrap();
        }
        let (mut x, mut v) = (0.0_f64, 0.0_f64);
        for (target, periods) in [(2.0, 400), (-1.0, 500), (5.0, 600), (2.9999, 200), (-4.0, 30), (1.0, 400)]
        {
            hal.setp("limit3.0.in", Value::Float(target)).unwrap();
            let end = f64::min(target, 3.0);
            let mut over = 0.0_f64;
            let (from, was) = (x, v);
            for _ in 0..periods {
                hal.run(None).unwrap();
                let next = hal.values().float(out);
                let speed = (next - x) / 1e-3;
                assert!(speed.abs() <= 10.0 + 1e-6, "{target}: {speed}");
                assert!((speed - v).abs() <= 0.1 + 1e-6, "{target}: {speed} after {v}");
                (x, v) = (next, speed);
                over = over.max((x - end) * (end - from).signum());
            }
            if periods > 100 {
                assert_eq!(x, end, "not there");
            }
            if was == 0.0 {
                assert!(over <= 1e-9, "{target}: overshoot {over}");
            }
        }
    }
}
