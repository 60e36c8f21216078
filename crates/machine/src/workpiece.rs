//! What a touch probe can touch: boxes and half-spaces in a few words.
//!
//! `Z-5`: everything up to Z −5. `X10..40 Y0..20 Z..8`: a box; an open end is infinite, an axis that is not named too.

use pkm_kins::JointRange;

/// A box: what it takes up of X, Y and Z in machine coordinates, mm; a half-space has infinite sides.
pub type Solid = [JointRange; 3];

/// What to write instead.
pub const HELP: &str =
    "write for example \"Z-5\" (all below) or \"X10..40 Y0..20 Z..8\" (a box); mm, machine coordinates";

/// Reads one box.
///
/// # Errors
/// What is wrong with it.
pub fn solid(text: &str) -> Result<Solid, String> {
    let all = JointRange { min: f64::NEG_INFINITY, max: f64::INFINITY };
    let mut solid = [all; 3];
    let mut seen = [false; 3];
    for word in text.split_whitespace() {
        let letter = word.chars().next().map_or(' ', |letter| letter.to_ascii_uppercase());
        let axis = "XYZ".find(letter).ok_or_else(|| format!("`{word}` does not begin with X, Y or Z"))?;
        if std::mem::replace(&mut seen[axis], true) {
            return Err(format!("{letter} is given twice"));
        }
        // The letter was one of X, Y, Z: one byte.
        let (low, high) = word[1..].split_once("..").unwrap_or(("", &word[1..]));
        let number = |text: &str, open: f64| match text {
            "" => Ok(open),
            _ => match text.parse::<f64>() {
                Ok(value) if value.is_finite() && value.abs() < 1e9 => Ok(value),
                _ => Err(format!("`{text}` in `{word}` is not a number")),
            },
        };
        let range = JointRange { min: number(low, all.min)?, max: number(high, all.max)? };
        if range == all {
            return Err(format!("`{word}` has no number"));
        }
        if range.min > range.max {
            return Err(format!("`{word}` ends before it begins"));
        }
        solid[axis] = range;
    }
    if seen == [false; 3] { Err("nothing is written".to_owned()) } else { Ok(solid) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reads_half_spaces_and_boxes_and_refuses_nonsense() {
        let (low, high) = (f64::NEG_INFINITY, f64::INFINITY);
        let sides = |solid: Solid| solid.map(|range| (range.min, range.max));
        assert_eq!(sides(solid("Z-5").unwrap()), [(low, high), (low, high), (low, -5.0)]);
        assert_eq!(sides(solid("x10..40  Y0..20 z..8").unwrap()), [(10.0, 40.0), (0.0, 20.0), (low, 8.0)]);
        assert_eq!(sides(solid("X3..").unwrap())[0], (3.0, high));
        for text in [
            "", "5", "Z", "Z..", "Z5..1", "Z1 Z2", "Zx", "A5", "Znan", "Z1e99", "Z1..2..3", "\u{e9}5",
            "Z\u{e9}",
        ] {
            assert!(solid(text).is_err(), "{text:?}");
        }
    }
}
