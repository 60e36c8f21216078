//! LinuxCNC's parameter file: lines `number value` in ascending order. What is read is either whole or refused;
//! what is written begins with a mark and ends with a checksum, both in lines that other readers skip.

use crate::error::ErrorKind;
use crate::expression::LAST_PARAMETER;
use crate::parameters::{Parameters, is_persistent};
use alloc::string::String;
use alloc::vec::Vec;
use core::fmt::Write;

/// The first line: a file that begins with it ends with a checksum, or it was cut.
const MARK: &str = "; pkm parameters\n";

/// Begins the last line: a checksum (CRC-32 of all bytes before it) and the number of entries.
const CHECKSUM: &str = "; pkm checksum ";

/// What a parameter file holds: the values, and which numbers it keeps besides the persistent ones.
#[derive(Debug, Clone, Default)]
pub struct ParameterFile {
    /// Numbers in the file that are not persistent by themselves.
    kept: Vec<i32>,
}

impl ParameterFile {
    /// Reads a file into `parameters`. A missing number is 0. Without mark and checksum (LinuxCNC's own files) a line
    /// that does not begin with a number is a remark, and what gives a cut file away is an unfinished last line.
    ///
    /// # Errors
    /// The line, counted from 1, and what is wrong with it; `parameters` is not touched then.
    pub fn read(text: &[u8], parameters: &mut Parameters) -> Result<Self, (u32, ErrorKind)> {
        let mut file = Self::default();
        let mut values = Vec::new();
        let (mut last, mut offset, mut lines) = (0, 0_usize, 0_u32);
        let mut verified = !text.starts_with(MARK.as_bytes());
        for (number, line) in (1..).zip(text.split_inclusive(|&b| b == b'\n')) {
            lines = number;
            if !line.ends_with(b"\n") || line.contains(&0) {
                return Err((number, ErrorKind::ParameterFileCut));
            }
            if line.starts_with(CHECKSUM.as_bytes()) {
                let whole = offset + line.len() == text.len();
                if !whole || checksum_line(&text[..offset], values.len()).as_bytes() != line {
                    return Err((number, ErrorKind::ParameterFileDamaged));
                }
                verified = true;
            }
            offset += line.len();
            let words = line.trim_ascii();
            if !words.first().is_some_and(|b| b.is_ascii_digit() || matches!(b, b'+' | b'-' | b'.')) {
                continue;
            }
            let (index, value) = entry(words).ok_or((number, ErrorKind::ParameterFileLine))?;
            if !(1..=LAST_PARAMETER).contains(&index) {
                return Err((number, ErrorKind::ParamRange { value: index.into() }));
            }
            if index <= last {
                return Err((number, ErrorKind::ParameterFileOrder { index, last }));
            }
            if !value.is_finite() {
                return Err((number, ErrorKind::ParameterFileLine));
            }
            last = index;
            values.push((index, value));
            if !is_persistent(index) {
                file.kept.push(index);
            }
        }
        if text.is_empty() || !verified {
            return Err((lines, ErrorKind::ParameterFileCut));
        }
        for (index, value) in values {
            parameters.set(index, value);
        }
        Ok(file)
    }

    /// The text to write: every persistent number and every number that was in the file, `number`, tab, value. Six
    /// decimals as LinuxCNC writes them where they say the value exactly, else as many as it needs.
    pub fn text(&self, parameters: &Parameters) -> Vec<u8> {
        let mut text = String::from(MARK);
        let mut count = 0;
        for index in 1..=LAST_PARAMETER {
            if is_persistent(index) || self.kept.binary_search(&index).is_ok() {
                let value = parameters.get(index);
                let six = alloc::format!("{value:.6}");
                // Writing to a string cannot fail.
                let _ = match six.parse() == Ok(value) {
                    true => writeln!(text, "{index}\t{six}"),
                    false => writeln!(text, "{index}\t{value}"),
                };
                count += 1;
            }
        }
        let sum = checksum_line(text.as_bytes(), count);
        text.push_str(&sum);
        text.into_bytes()
    }
}

/// `number value` and nothing else; a remark may follow behind `;`.
fn entry(line: &[u8]) -> Option<(i32, f64)> {
    let line = core::str::from_utf8(line).ok()?;
    let mut words = line.split(';').next()?.split_ascii_whitespace();
    let entry = (words.next()?.parse().ok()?, words.next()?.parse().ok()?);
    words.next().is_none().then_some(entry)
}

fn checksum_line(bytes: &[u8], count: usize) -> String {
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
    fn values_come_back_to_the_last_bit() {
        let mut parameters = Parameters::default();
        parameters.set(5221, 1.0 / 3.0);
        parameters.set(5222, -1e-9);
        parameters.set(5223, 2.5);
        let text = ParameterFile::default().text(&parameters);
        assert!(text.windows(14).any(|bytes| bytes == b"5223\t2.500000\n"));
        let mut again = Parameters::default();
        ParameterFile::read(&text, &mut again).unwrap();
        assert_eq!([5221, 5222, 5223].map(|i| again.get(i)), [1.0 / 3.0, -1e-9, 2.5]);
    }

    #[test]
    fn every_cut_and_every_changed_byte_is_refused() {
        assert_eq!(crc32(b"123456789"), 0xcbf4_3926); // the standard check value
        let text = ParameterFile::default().text(&Parameters::default());
        let mut untouched = Parameters::default();
        for at in 0..text.len() {
            for bit in [1, 4, 0x20, 0x80] {
                let mut damaged = text.clone();
                damaged[at] ^= bit;
                assert!(ParameterFile::read(&damaged, &mut untouched).is_err(), "byte {at} bit {bit}");
            }
            assert!(ParameterFile::read(&text[..at], &mut untouched).is_err(), "cut at {at}");
        }
        let doubled = [&text[..], &text[..]].concat();
        assert!(ParameterFile::read(&doubled, &mut untouched).is_err());
    }

    #[test]
    fn files_of_others_are_read_or_refused_whole() {
        let refused = [
            "",
            "5161 2\n5220",
            "5221 1\n5161 2\n",
            "5221 1\n5221 2\n",
            "9999 1\n",
            "0 1\n",
            "5221 nan\n",
            "5221 inf\n",
            "5221 1e999\n",
            "5221\n",
            "5221 1 2\n",
            "5221 1x\n",
            "52\u{0}21 1\n",
            "-1 1\n",
        ];
        for text in refused {
            let mut parameters = Parameters::default();
            let text = alloc::format!("31 7\n{text}");
            let text = if text == "31 7\n" { "" } else { text.as_str() };
            assert!(ParameterFile::read(text.as_bytes(), &mut parameters).is_err(), "{text:?}");
            assert_eq!(parameters.get(31), 0.0, "{text:?} was half read");
        }
        let mut parameters = Parameters::default();
        ParameterFile::read(b"remark\r\n\r\n 31 7 ; why\r\n5221\t-1e-3\r\n", &mut parameters).unwrap();
        assert_eq!((parameters.get(31), parameters.get(5221)), (7.0, -1e-3));
    }
}
