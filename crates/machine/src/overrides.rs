//! `--set KEY=VALUE`: changes keys of a machine file before it is validated.
//!
//! KEY is a dotted path; a number picks an element of an array, `*` every element: `joint.*.max_velocity_mm_s=100`.
//! A key that the file does not have is added where its table can be found or made, so that optional keys can be set;
//! what no machine file may have is then refused as an unknown key. VALUE is TOML; a bare word is taken as a string.

use crate::source::{Findings, Source};
use std::borrow::Cow;
use std::ops::Range;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

type Value<'i> = Spanned<DeValue<'i>>;

/// Applies the overrides in order.
pub(crate) fn apply<'i>(
    table: &mut DeTable<'i>,
    overrides: &'i [String],
    source: &Source,
    findings: &mut Findings<'_>,
) {
    for (index, text) in overrides.iter().enumerate() {
        let offset = source.override_offset(index);
        let Some((key, value_text)) = text.split_once('=') else {
            let message = format!("`{text}` is not KEY=VALUE");
            findings.error("machine-override", offset..offset + text.len(), message, EXAMPLE);
            continue;
        };
        let value_offset = offset + key.len() + 1 + (value_text.len() - value_text.trim_start().len());
        let Some(value) = parse(value_text.trim(), value_offset) else {
            let message = format!("`{value_text}` is not a TOML value");
            findings.error("machine-override", value_offset..offset + text.len(), message, EXAMPLE);
            continue;
        };
        let key_span = offset..offset + key.trim_end().len();
        let path: Vec<&str> = key.trim().split('.').collect();
        if path.iter().any(|segment| segment.is_empty()) || !set_in_table(table, &path, &value, &key_span) {
            let message = format!("`{}` matches nothing in the machine file", key.trim());
            let help = "an index is counted from 0; `pkm machines NAME` prints a machine's keys";
            findings.error("machine-override", key_span, message, help);
        }
    }
}

const EXAMPLE: &str = "write for example --set 'joint.*.max_velocity_mm_s=100'";

/// Sets the value below a table; false if the path leads nowhere.
fn set_in_table<'i>(
    table: &mut DeTable<'i>,
    path: &[&'i str],
    value: &Value<'i>,
    key: &Range<usize>,
) -> bool {
    let [segment, rest @ ..] = path else { return false };
    if *segment == "*" {
        let mut any = false;
        for (_, child) in table.iter_mut() {
            any |= set_at(child, rest, value, key);
        }
        return any;
    }
    if let Some(child) = table.get_mut(*segment) {
        return set_at(child, rest, value, key);
    }
    // Not there yet: make it, unless an array would have to be invented.
    if rest.iter().any(|segment| *segment == "*" || segment.parse::<usize>().is_ok()) {
        return false;
    }
    let mut child = Spanned::new(key.clone(), DeValue::Table(DeTable::new()));
    let set = set_at(&mut child, rest, value, key);
    table.insert(Spanned::new(key.clone(), Cow::Borrowed(*segment)), child);
    set
}

/// Sets the value here if the path ends, otherwise further down.
fn set_at<'i>(node: &mut Value<'i>, path: &[&'i str], value: &Value<'i>, key: &Range<usize>) -> bool {
    let [segment, rest @ ..] = path else {
        *node = value.clone();
        return true;
    };
    match node.get_mut() {
        DeValue::Table(table) => set_in_table(table, path, value, key),
        DeValue::Array(array) => {
            let mut any = false;
            for (index, child) in array.iter_mut().enumerate() {
                if *segment == "*" || segment.parse() == Ok(index) {
                    any |= set_at(child, rest, value, key);
                }
            }
            any
        }
        _ => false,
    }
}

/// A TOML value (or a bare word) whose spans count from `offset`.
fn parse(text: &str, offset: usize) -> Option<Value<'_>> {
    if let Ok(value) = DeValue::parse(text) {
        return Some(shift(value, offset));
    }
    let bare = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
    (!text.is_empty() && text.chars().all(bare))
        .then(|| Spanned::new(offset..offset + text.len(), DeValue::String(Cow::Borrowed(text))))
}

/// Moves all spans of a value by `offset`.
fn shift(value: Value<'_>, offset: usize) -> Value<'_> {
    let span = value.span();
    let moved = match value.into_inner() {
        DeValue::Array(array) => DeValue::Array(array.into_iter().map(|item| shift(item, offset)).collect()),
        DeValue::Table(table) => {
            DeValue::Table(table.into_iter().map(|(key, item)| (key, shift(item, offset))).collect())
        }
        other => other,
    };
    Spanned::new(span.start + offset..span.end + offset, moved)
}
