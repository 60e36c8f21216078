//! Bytes and text inside a page: numbers as base64, text so that no program can become markup.

use std::fmt::Write;

/// Little-endian numbers, to be written as base64.
#[derive(Debug, Clone, Default)]
pub(crate) struct Bytes(Vec<u8>);

impl Bytes {
    pub(crate) fn u8(&mut self, value: u8) {
        self.0.push(value);
    }

    pub(crate) fn f32(&mut self, value: f64) {
        self.0.extend_from_slice(&(value as f32).to_le_bytes());
    }

    pub(crate) fn f64(&mut self, value: f64) {
        self.0.extend_from_slice(&value.to_le_bytes());
    }

    /// Seven bits a byte, lowest first; the eighth says that more follow.
    pub(crate) fn varint(&mut self, mut value: u64) {
        while value >= 0x80 {
            self.0.push((value as u8) | 0x80);
            value >>= 7;
        }
        self.0.push(value as u8);
    }

    /// A signed number: sign in the lowest bit.
    pub(crate) fn signed(&mut self, value: i64) {
        self.varint(((value << 1) ^ (value >> 63)) as u64);
    }

    pub(crate) fn base64(&self) -> String {
        const DIGITS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
        let mut text = String::with_capacity(self.0.len() / 3 * 4 + 4);
        for chunk in self.0.chunks(3) {
            let byte = |i: usize| u32::from(chunk.get(i).copied().unwrap_or(0));
            let bits = (byte(0) << 16) | (byte(1) << 8) | byte(2);
            for place in 0..4 {
                if place <= chunk.len() {
                    text.push(DIGITS[((bits >> (18 - 6 * place)) & 63) as usize] as char);
                } else {
                    text.push('=');
                }
            }
        }
        text
    }
}

/// JSON that may stand in a `<script>` element: the characters that could end it are escaped.
pub(crate) fn script(json: &str) -> String {
    let mut text = String::with_capacity(json.len());
    for c in json.chars() {
        match c {
            '<' | '>' | '&' | '\u{2028}' | '\u{2029}' | '\u{7f}' => {
                let _ = write!(text, "\\u{:04x}", c as u32);
            }
            c => text.push(c),
        }
    }
    text
}

/// Text that may stand in an element or a quoted attribute. Control characters become their pictures.
pub(crate) fn html(plain: &str) -> String {
    let mut text = String::with_capacity(plain.len());
    for c in plain.chars() {
        match c {
            '&' => text.push_str("&amp;"),
            '<' => text.push_str("&lt;"),
            '>' => text.push_str("&gt;"),
            '"' => text.push_str("&quot;"),
            '\'' => text.push_str("&#39;"),
            '\n' => text.push('\n'),
            c if (c as u32) < 0x20 => text.push(char::from_u32(0x2400 + c as u32).unwrap_or('?')),
            c => text.push(c),
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base64_of_every_length() {
        for (bytes, text) in [("", ""), ("f", "Zg=="), ("fo", "Zm8="), ("foo", "Zm9v"), ("foob", "Zm9vYg==")]
        {
            assert_eq!(Bytes(bytes.into()).base64(), text);
        }
    }

    #[test]
    fn numbers_of_any_size() {
        let mut bytes = Bytes::default();
        for value in [0, 127, 128, 300] {
            bytes.varint(value);
        }
        bytes.signed(-1);
        bytes.signed(64);
        assert_eq!(bytes.0, [0, 0x7f, 0x80, 1, 0xac, 2, 1, 0x80, 1]);
    }

    #[test]
    fn nothing_ends_a_script_or_an_attribute() {
        let nasty = "</script><!--<script> & \u{2028} \"'\0";
        let json = script(&serde_json::to_string(nasty).unwrap());
        assert!(!json.contains(['<', '>', '&', '\u{2028}', '\0']), "{json}");
        assert_eq!(serde_json::from_str::<String>(&json).unwrap(), nasty);
        assert!(!html(nasty).contains(['<', '>', '"', '\'', '\0']));
    }
}
