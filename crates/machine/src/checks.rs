//! Checks of single numbers. Each notes a finding and returns `None`, or returns the number.

use crate::file::{Nanoseconds, Number};
use crate::source::Findings;
use pkm_kins::{JointKind, JointRange, maths};
use std::ops::RangeInclusive;
use toml::Spanned;

/// The largest magnitude of any number (1 km, a million steps per mm ...).
const MAX_MAGNITUDE: f64 = 1e6;
/// Rates may be larger: mm/s².
const MAX_RATE: f64 = 1e9;

/// A finite number of sane size.
pub(crate) fn finite(key: &str, number: &Number, findings: &mut Findings<'_>) -> Option<f64> {
    bounded(key, number, MAX_MAGNITUDE, findings)
}

fn bounded(key: &str, number: &Number, largest: f64, findings: &mut Findings<'_>) -> Option<f64> {
    let value = *number.get_ref();
    if !value.is_finite() {
        let message = format!("{key} = {value} is not a finite number");
        findings.error("machine-not-finite", number.span(), message, "write a number");
        return None;
    }
    if value.abs() > largest {
        let message = format!("{key} = {value} is beyond ±{largest:e}");
        findings.error("machine-range", number.span(), message, "check the unit");
        return None;
    }
    Some(value)
}

/// A number above 0.
pub(crate) fn positive(key: &str, number: &Number, findings: &mut Findings<'_>) -> Option<f64> {
    let value = bounded(key, number, MAX_RATE, findings)?;
    if value <= 0.0 {
        let message = format!("{key} = {value} must be larger than 0");
        findings.error("machine-not-positive", number.span(), message, "write a number above 0");
        return None;
    }
    Some(value)
}

/// A number not below 0.
pub(crate) fn not_negative(key: &str, number: &Number, findings: &mut Findings<'_>) -> Option<f64> {
    let value = finite(key, number, findings)?;
    if value < 0.0 {
        let message = format!("{key} = {value} must not be negative");
        findings.error("machine-range", number.span(), message, "write 0 or more");
        return None;
    }
    Some(value)
}

/// A whole number in a range.
pub(crate) fn integer(
    key: &str,
    number: &Nanoseconds,
    range: RangeInclusive<i64>,
    findings: &mut Findings<'_>,
) -> Option<u64> {
    let value = *number.get_ref();
    if !range.contains(&value) {
        let message = format!("{key} = {value} is outside {} to {}", range.start(), range.end());
        findings.error("machine-range", number.span(), message, "the unit is ns");
        return None;
    }
    u64::try_from(value).ok()
}

/// A name: 1 to 41 letters, digits, `-`, `_`, `.` (it appears in HAL names and file headers).
pub(crate) fn identifier(key: &str, name: &Spanned<String>, findings: &mut Findings<'_>) -> Option<String> {
    let text = name.get_ref();
    let plain = |c: char| c.is_ascii_alphanumeric() || matches!(c, '-' | '_' | '.');
    if text.is_empty() || text.len() > 41 || !text.chars().all(plain) {
        let message = format!("{key} {text:?} is not a name");
        let help = "1 to 41 letters, digits, `-`, `_`, `.`";
        findings.error("machine-name", name.span(), message, help);
        return None;
    }
    Some(text.clone())
}

/// A range from its two ends; both must be there, finite and in order.
pub(crate) fn range(
    min: Option<(String, &Number)>,
    max: Option<(String, &Number)>,
    kind: JointKind,
    findings: &mut Findings<'_>,
) -> Option<JointRange> {
    let low = min.as_ref().and_then(|(key, number)| finite(key, number, findings));
    let high = max.as_ref().and_then(|(key, number)| finite(key, number, findings));
    let (low, high) = (low?, high?);
    if low >= high {
        let ((min_key, _), (max_key, number)) = (min?, max?);
        let message = format!("{min_key} = {low} is not below {max_key} = {high}");
        findings.error(
            "machine-range",
            number.span(),
            message,
            "the upper end must be larger than the lower",
        );
        return None;
    }
    Some(match kind {
        JointKind::Linear => JointRange { min: low, max: high },
        JointKind::Rotary => JointRange { min: maths::radians(low), max: maths::radians(high) },
    })
}
