//! Text encodings: UTF-8, UTF-16 with a byte-order mark, Windows-1252.

/// Streaming converter of UTF-16 to UTF-8; other bytes pass unchanged.
///
/// ```
/// use palpate_estimators::recording::TextDecoder;
///
/// let mut decoder = TextDecoder::default();
/// let mut text = decoder.decode(b"\xff\xfeX\0,");
/// text.extend(decoder.decode(b"\0Y\0"));
/// assert_eq!(text, b"X,Y");
/// ```
#[derive(Clone, Debug, Default)]
pub struct TextDecoder {
    encoding: Option<Encoding>,
    /// Incomplete character.
    pending: Vec<u8>,
}

#[derive(Clone, Copy, Debug)]
enum Encoding {
    Bytes,
    Utf16(fn([u8; 2]) -> u16),
}

impl TextDecoder {
    /// Decodes a chunk; invalid UTF-16 becomes U+FFFD.
    pub fn decode(&mut self, chunk: &[u8]) -> Vec<u8> {
        self.pending.extend_from_slice(chunk);
        let (encoding, mark) = match (self.encoding, self.pending.as_slice()) {
            (Some(encoding), _) => (encoding, 0),
            (None, []) | (None, [0xFF | 0xFE]) => return Vec::new(),
            (None, [0xFF, 0xFE, ..]) => (Encoding::Utf16(u16::from_le_bytes), 2),
            (None, [0xFE, 0xFF, ..]) => (Encoding::Utf16(u16::from_be_bytes), 2),
            (None, _) => (Encoding::Bytes, 0),
        };
        self.encoding = Some(encoding);
        let bytes = std::mem::take(&mut self.pending);
        match encoding {
            Encoding::Bytes => bytes,
            Encoding::Utf16(unit) => self.decode_units(&bytes[mark..], unit),
        }
    }

    /// Returns the remaining text.
    pub fn finish(self) -> Vec<u8> {
        match self.encoding {
            Some(Encoding::Utf16(_)) if !self.pending.is_empty() => "\u{fffd}".into(),
            _ => self.pending,
        }
    }

    /// True for UTF-16.
    pub fn is_utf16(&self) -> bool {
        matches!(self.encoding, Some(Encoding::Utf16(_)))
    }

    fn decode_units(&mut self, bytes: &[u8], unit: fn([u8; 2]) -> u16) -> Vec<u8> {
        let pairs = bytes.chunks_exact(2);
        let mut left = pairs.remainder().to_vec();
        let mut units: Vec<u16> = pairs.map(|pair| unit([pair[0], pair[1]])).collect();
        // The second half of a character beyond U+FFFF may be in the next chunk.
        if units.last().is_some_and(|unit| (0xD800..0xDC00).contains(unit)) {
            units.pop();
            left.splice(0..0, bytes[2 * units.len()..][..2].iter().copied());
        }
        self.pending = left;
        let characters = char::decode_utf16(units);
        characters.map(|c| c.unwrap_or(char::REPLACEMENT_CHARACTER)).collect::<String>().into_bytes()
    }
}

/// `None` for undefined and null bytes.
pub(super) fn windows_1252(bytes: &[u8]) -> Option<String> {
    /// 0x80 to 0x9F; spaces are undefined.
    const HIGH: &str = "€ ‚ƒ„…†‡ˆ‰Š‹Œ Ž  ‘’“”•–—˜™š›œ žŸ";
    bytes
        .iter()
        .map(|byte| match byte {
            0 => None,
            0x80..=0x9F => HIGH.chars().nth(usize::from(byte - 0x80)).filter(|c| *c != ' '),
            _ => Some(char::from(*byte)),
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reads_windows_1252() {
        assert_eq!(windows_1252(b"Stra\xdfe, 5 \xb5m, \x80").as_deref(), Some("Straße, 5 µm, €"));
        assert_eq!(windows_1252(b"\x9fa\x81"), None);
        assert_eq!(windows_1252(b"\xff\0a\0"), None);
        assert_eq!(windows_1252(b"\x80\x8e\x91\x9e\x9f").as_deref(), Some("€Ž‘žŸ"));
    }

    fn decoded(bytes: &[u8], length: usize) -> String {
        let mut decoder = TextDecoder::default();
        let mut text: Vec<u8> = bytes.chunks(length).flat_map(|chunk| decoder.decode(chunk)).collect();
        text.extend(decoder.finish());
        String::from_utf8(text).unwrap()
    }

    #[test]
    fn reads_utf16_of_both_byte_orders_in_any_chunks() {
        let text = "Größe [µm];𝛼\r\n1,5;2\r\n";
        let units: Vec<u16> = std::iter::once(0xFEFF).chain(text.encode_utf16()).collect();
        let little: Vec<u8> = units.iter().flat_map(|unit| unit.to_le_bytes()).collect();
        let big: Vec<u8> = units.iter().flat_map(|unit| unit.to_be_bytes()).collect();
        for length in [1, 2, 3, 5, 1000] {
            assert_eq!(decoded(&little, length), text);
            assert_eq!(decoded(&big, length), text);
            assert_eq!(decoded("\u{feff}µ".as_bytes(), length), "\u{feff}µ");
        }
        assert_eq!(decoded(b"\xff\xfea\0\x00\xd8", 1), "a\u{fffd}");
        assert_eq!(decoded(b"\xff\xfea\0\x00\xdcb", 3), "a\u{fffd}\u{fffd}");
        assert_eq!(decoded(b"", 1), "");
    }
}
