//! LinuxCNC's parameter file: lines `number value` in ascending order. What is read is either whole or refused;
//! what is written ends with a checksum line that other readers skip.

use crate::error::ErrorKind;
use crate::expression::LAST_PARAMETER;
use crate::parameters::{Parameters, is_persistent};
use alloc::vec::Vec;
use core::fmt::Write;

/// Begins the last line: a checksum (CRC-32 of all bytes before it) and the number of entries.
const CHECKSUM: &str = "; pkm checksum ";

/// What a parameter file holds: the values, and which numbers it keeps besides the persistent ones.
#[derive(Debug, Clone, Default)]
pub struct ParameterFile {
    /// Numbers in the file that are not persistent by themselves.
    kept: Vec<i32>,
}

impl ParameterFile {
    /// Reads a file into `parameters`. A missing number is 0. Without a checksum line (LinuxCNC's own files) the text
    /// is taken as it is.
    ///
    /// # Errors
    /// The line, counted from 1, and what is wrong with it; `parameters` is not touched then.
    pub fn read(text: &[u8], parameters: &mut Parameters) -> Result<Self, (u32, ErrorKind)> {
        let mut file = Self::default();
        let mut values = Vec::new();
        let (mut last, mut offset) = (0, 0_usize);
        for (number, line) in (1..).zip(text.split_inclusive(|&b| b == b'\n')) {
            let words = line.trim_ascii();
            if let Some(sum) = words.strip_prefix(CHECKSUM.as_bytes()) {
                let expected = checksum_line(&text[..offset], values.len());
                if expected.as_bytes().trim_ascii() != words || sum.is_empty() {
                    return Err((number, ErrorKind::ParameterFileDamaged));
                }
            }
            offset += line.len();
            let Some((index, value)) = entry(words) else { continue };
            if !(1..=LAST_PARAMETER).contains(&index) {
                return Err((number, ErrorKind::ParamRange { value: index.into() }));
            }
            if index <= last {
                return Err((number, ErrorKind::ParameterFileOrder { index, last }));
            }
            if !value.is_finite() {
                return Err((number, ErrorKind::BadNumber));
            }
            last = index;
            values.push((index, value));
            if !is_persistent(index) {
                file.kept.push(index);
            }
        }
        for (index, value) in values {
            parameters.set(index, value);
        }
        Ok(file)
    }

    /// The text to write: every persistent number and every number that was in the file, `%d\t%f`.
    pub fn text(&self, parameters: &Parameters) -> Vec<u8> {
        let mut text = alloc::string::String::new();
        let mut count = 0;
        for index in 1..=LAST_PARAMETER {
            if is_persistent(index) || self.kept.binary_search(&index).is_ok() {
                // Writing to a string cannot fail.
                let _ = writeln!(text, "{index}\t{:.6}", parameters.get(index));
                count += 1;
            }
        }
        let sum = checksum_line(text.as_bytes(), count);
        text.push_str(&sum);
        text.into_bytes()
    }
}

/// `number value`; anything else is no entry.
fn entry(words: &[u8]) -> Option<(i32, f64)> {
    let mut words = words.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty());
    let mut next = || core::str::from_utf8(words.next()?).ok();
    let (index, value) = (next()?, next()?);
    Some((index.parse().ok()?, value.parse().ok()?))
}

fn checksum_line(bytes: &[u8], count: usize) -> alloc::string::String {
    alloc::format!("{CHECKSUM}{:08x} {count}\n", crc32(bytes))
}

/// CRC-32 (IEEE 802.3), bit by bit: the file has a few hundred lines.
fn crc32(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(!0_u32, |crc, byte| {
        (0..8).fold(crc ^ u32::from(*byte), |crc, _| (crc >> 1) ^ (0xedb8_8320 & (crc & 1).wrapping_neg()))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn comes_back_as_written() {
        let mut parameters = Parameters::default();
        let file = ParameterFile::read(b"100 1.5\n5221\t-3.25\nnote\n", &mut parameters).unwrap();
        assert_eq!((parameters.get(100), parameters.get(5221)), (1.5, -3.25));
        let text = file.text(&parameters);
        let mut again = Parameters::default();
        ParameterFile::read(&text, &mut again).unwrap();
        assert_eq!((again.get(100), again.get(5221), again.get(5220)), (1.5, -3.25, 1.0));
    }

    #[test]
    fn every_damaged_byte_is_refused_or_harmless() {
        let text = ParameterFile::default().text(&Parameters::default());
        assert_eq!(crc32(b"123456789"), 0xcbf4_3926); // the standard check value
        for at in 0..text.len() {
            let mut damaged = text.clone();
            damaged[at] ^= 1;
            // A damaged checksum line is no longer one; everything before it is still whole.
            let begins = text.len() - checksum_line(b"", 0).len();
            let read = ParameterFile::read(&damaged, &mut Parameters::default());
            assert!(read.is_err() || at + 8 >= begins, "byte {at}");
        }
        assert!(ParameterFile::read(b"5221 1\n5161 2\n", &mut Parameters::default()).is_err());
        assert!(ParameterFile::read(b"9999 1\n", &mut Parameters::default()).is_err());
        assert!(ParameterFile::read(b"5221 nan\n", &mut Parameters::default()).is_err());
    }
}
