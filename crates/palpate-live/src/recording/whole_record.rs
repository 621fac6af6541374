//! Parser that checks lengths first, because that of MCAP allocates any stated length.

use mcap::records::{Record, op};

#[derive(Clone, Copy)]
enum Part {
    Bytes(usize),
    /// Four bytes of length, and the text.
    Text,
    /// Eight bytes of length, and the data.
    Long,
    /// Four bytes of length, and pairs of texts.
    Map,
}

use Part::{Bytes, Long, Map, Text};

fn parts(kind: u8) -> Option<&'static [Part]> {
    match kind {
        op::CHANNEL => Some(&[Bytes(2 + 2), Text, Text, Map]),
        op::MESSAGE => Some(&[Bytes(2 + 4 + 8 + 8)]),
        op::CHUNK => Some(&[Bytes(8 + 8 + 8 + 4), Text, Long]),
        op::MESSAGE_INDEX => Some(&[Bytes(2), Text]),
        op::ATTACHMENT => Some(&[Bytes(8 + 8), Text, Text, Long, Bytes(4)]),
        op::METADATA => Some(&[Text, Map]),
        _ => None,
    }
}

/// `None` for unused kinds, or invalid lengths.
pub(super) fn parse(kind: u8, body: &[u8]) -> Option<Record<'_>> {
    let mut rest = body;
    for part in parts(kind)? {
        rest = after(*part, rest)?;
    }
    mcap::parse_record(kind, body).ok()
}

fn after(part: Part, bytes: &[u8]) -> Option<&[u8]> {
    let past = |head: usize, length: u64| bytes.get(head..)?.get(usize::try_from(length).ok()?..);
    let short = || bytes.first_chunk().copied().map(u32::from_le_bytes);
    match part {
        Bytes(count) => bytes.get(count..),
        Text => past(4, short()?.into()),
        Long => past(8, bytes.first_chunk().copied().map(u64::from_le_bytes)?),
        Map => {
            let after_map = past(4, short()?.into())?;
            let mut pairs = &bytes[4..bytes.len() - after_map.len()];
            while !pairs.is_empty() {
                // Without this check, the value of an unpaired key would be read beyond the map.
                pairs = after(Text, after(Text, pairs)?)?;
            }
            Some(after_map)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn text(text: &str) -> Vec<u8> {
        [&(text.len() as u32).to_le_bytes()[..], text.as_bytes()].concat()
    }

    #[test]
    fn metadata_are_read_and_lengths_beyond_the_record_are_not_believed() {
        let pairs = [text("key"), text("value")].concat();
        let map = [&(pairs.len() as u32).to_le_bytes()[..], &pairs].concat();
        let whole = [text("palpate"), map].concat();
        let Some(Record::Metadata(found)) = parse(op::METADATA, &whole) else { panic!("it is whole") };
        assert_eq!((found.name.as_str(), found.metadata["key"].as_str()), ("palpate", "value"));
        for at in [0, 11, 15, 22] {
            let mut wrong = whole.clone();
            wrong[at..at + 4].fill(0xFF);
            assert!(parse(op::METADATA, &wrong).is_none(), "{at}");
        }
        (0..whole.len())
            .for_each(|length| assert!(parse(op::METADATA, &whole[..length]).is_none(), "{length}"));
    }

    #[test]
    fn a_key_without_a_value_is_not_read_on_beyond_its_map() {
        let map = [&7u32.to_le_bytes()[..], &text("key")].concat();
        assert!(parse(op::METADATA, &[text("palpate"), map, vec![0xFF; 8]].concat()).is_none());
    }

    #[test]
    fn other_kinds_are_none() {
        assert!(parse(op::STATISTICS, &[0; 64]).is_none());
    }
}
