use std::fmt::Write;

const MOST: usize = 80;

/// Escapes unprintable bytes, and cuts after 80 characters.
pub fn quote(bytes: &[u8]) -> String {
    let mut quotation = String::new();
    let mut length = 0;
    for chunk in bytes.utf8_chunks() {
        let shown = chunk.valid().chars().map(printable);
        let escaped = chunk.invalid().iter().map(|byte| format!("\\x{byte:02X}"));
        for part in shown.chain(escaped) {
            length += part.chars().count();
            if length > MOST - 1 {
                quotation.push('…');
                return quotation;
            }
            quotation.push_str(&part);
        }
    }
    quotation
}

fn printable(letter: char) -> String {
    let mut part = String::new();
    // Writing into a string cannot fail.
    let _ = match letter {
        '\t' => write!(part, "\\t"),
        '\r' => write!(part, "\\r"),
        '\n' => write!(part, "\\n"),
        ' '..='~' => write!(part, "{letter}"),
        _ if letter.is_alphanumeric() || "°µ§²³Ω→−".contains(letter) => write!(part, "{letter}"),
        _ if letter.is_ascii() => write!(part, "\\x{:02X}", u32::from(letter)),
        _ => write!(part, "\\u{{{:X}}}", u32::from(letter)),
    };
    part
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_that_are_no_text_are_escaped() {
        assert_eq!(quote("1,2 µ\t\x1B[31m".as_bytes()), "1,2 µ\\t\\x1B[31m");
        assert_eq!(quote(b"\xFF\x001"), "\\xFF\\x001");
        assert_eq!(quote("\u{202E}x".as_bytes()), "\\u{202E}x");
    }

    #[test]
    fn quotations_have_at_most_80_characters() {
        assert_eq!(quote(&[b'7'; 200]).chars().count(), 80);
        assert!(quote(&[0xFF; 200]).chars().count() <= 80);
        assert_eq!(quote(&[b'7'; 79]).len(), 79);
    }
}
