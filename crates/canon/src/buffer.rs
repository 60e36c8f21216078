//! A line of text being written.

use crate::decimal::Digits;

/// Longest line: a source line's comment with its substitutions, or nine huge numbers.
const LINE_ROOM: usize = 4096;

/// A bounded line; what does not fit is cut.
pub(crate) struct Buffer<const ROOM: usize = LINE_ROOM> {
    bytes: [u8; ROOM],
    length: usize,
}

impl<const ROOM: usize> Buffer<ROOM> {
    pub(crate) const fn new() -> Self {
        Self { bytes: [0; ROOM], length: 0 }
    }

    pub(crate) fn clear(&mut self) {
        self.length = 0;
    }

    pub(crate) fn as_bytes(&self) -> &[u8] {
        &self.bytes[..self.length]
    }

    /// Inline, so that a literal of known length is stored without a call.
    #[inline(always)]
    pub(crate) fn put(&mut self, bytes: &[u8]) {
        match self.bytes.get_mut(self.length..self.length + bytes.len()) {
            Some(place) => {
                place.copy_from_slice(bytes);
                self.length += bytes.len();
            }
            None => self.put_cut(bytes),
        }
    }

    #[cold]
    fn put_cut(&mut self, bytes: &[u8]) {
        let room = &mut self.bytes[self.length..];
        room.copy_from_slice(&bytes[..room.len()]);
        self.length = ROOM;
    }

    pub(crate) fn integer(&mut self, value: i64) {
        if value < 0 {
            self.put(b"-");
        }
        self.put(Digits::integer(value.unsigned_abs()).as_bytes());
    }

    /// Right-aligned in `width` places.
    pub(crate) fn padded(&mut self, value: u64, width: usize) {
        let digits = Digits::integer(value);
        for _ in digits.as_bytes().len()..width {
            self.put(b" ");
        }
        self.put(digits.as_bytes());
    }

    /// A number with `DECIMALS` (0 to 6) digits after the point.
    pub(crate) fn number<const DECIMALS: u32>(&mut self, value: f64) {
        match Digits::decimal::<DECIMALS>(value) {
            Some(digits) => self.put(digits.as_bytes()),
            None => {
                // What does not fit is cut.
                let _ = core::fmt::Write::write_fmt(self, format_args!("{value:.*}", DECIMALS as usize));
            }
        }
    }
}

impl<const ROOM: usize> core::fmt::Write for Buffer<ROOM> {
    fn write_str(&mut self, text: &str) -> core::fmt::Result {
        self.put(text.as_bytes());
        Ok(())
    }
}
