//! Binary frames with COBS stuffing, ended by a zero; little-endian.
//!
//! | bytes | content |
//! |---|---|
//! | 1 | type, 1 |
//! | 4 | sequence number, wraps around |
//! | 4 | time by the board's clock in µs, wraps around |
//! | 1 | number `n` of values |
//! | 4 n | values, IEEE 754 single precision |
//! | 2 | CRC-16/CCITT-FALSE of the preceding bytes |
//!
//! COBS: Cheshire, Baker, "Consistent Overhead Byte Stuffing", IEEE/ACM Transactions on Networking 7, 1999.
//! The crate `cobs` would add five dependencies.

use super::names::{Filling, Names, Role};
use super::{BadFrame, Frame};
use crc::{CRC_16_IBM_3740, Crc};
use std::time::Duration;

const CRC: Crc<u16> = Crc::<u16>::new(&CRC_16_IBM_3740);
const VALUES: u8 = 1;
const HEAD: usize = 10;
const TAIL: usize = 2;
/// Most bytes without the zero: 255 values, one more byte per 254.
pub const LONGEST: usize = HEAD + 4 * 255 + TAIL + 5;

/// Appends a frame; values beyond 255 are omitted.
pub fn encode_into(bytes: &mut Vec<u8>, sequence: u32, time_us: u32, values: &[f32]) {
    let values = &values[..values.len().min(255)];
    let mut frame = Vec::with_capacity(HEAD + 4 * values.len() + TAIL);
    frame.push(VALUES);
    frame.extend(sequence.to_le_bytes());
    frame.extend(time_us.to_le_bytes());
    frame.push(values.len() as u8);
    frame.extend(values.iter().flat_map(|value| value.to_le_bytes()));
    let checksum = CRC.checksum(&frame);
    frame.extend(checksum.to_le_bytes());
    stuff(&frame, bytes);
    bytes.push(0);
}

/// Decodes a stuffed frame without its zero.
pub fn decode(
    stuffed: &[u8],
    names: &Names,
    columns: &[Role],
    scratch: &mut Vec<u8>,
) -> Result<Frame, BadFrame> {
    unstuff(stuffed, scratch).ok_or(BadFrame::Malformed)?;
    let (frame, checksum) = scratch.split_last_chunk::<TAIL>().ok_or(BadFrame::Malformed)?;
    if CRC.checksum(frame) != u16::from_le_bytes(*checksum) {
        return Err(BadFrame::Checksum);
    }
    let ([kind, s0, s1, s2, s3, t0, t1, t2, t3, count], values) =
        frame.split_first_chunk::<HEAD>().ok_or(BadFrame::Malformed)?;
    let (values, rest) = values.as_chunks::<4>();
    if *kind != VALUES || values.len() != usize::from(*count) || !rest.is_empty() {
        return Err(BadFrame::Malformed);
    }
    if values.len() != columns.len() {
        return Err(BadFrame::Channels);
    }
    let mut filling = Filling::new(names);
    for (value, role) in values.iter().zip(columns) {
        filling.set(*role, f64::from(f32::from_le_bytes(*value)))?;
    }
    let time_us = u32::from_le_bytes([*t0, *t1, *t2, *t3]);
    filling.set_header(u32::from_le_bytes([*s0, *s1, *s2, *s3]), Duration::from_micros(time_us.into()));
    filling.finish()
}

fn stuff(bytes: &[u8], to: &mut Vec<u8>) {
    let mut rest = bytes;
    loop {
        let block = &rest[..rest.len().min(254)];
        let zero = block.iter().position(|byte| *byte == 0);
        let block = &block[..zero.unwrap_or(block.len())];
        to.push(block.len() as u8 + 1);
        to.extend_from_slice(block);
        // A full block does not imply a zero after it; neither does the last block.
        match zero {
            Some(zero) => rest = &rest[zero + 1..],
            None if block.len() == rest.len() => return,
            None => rest = &rest[block.len()..],
        }
    }
}

fn unstuff(stuffed: &[u8], to: &mut Vec<u8>) -> Option<()> {
    to.clear();
    let mut rest = stuffed;
    while let Some((code, after)) = rest.split_first() {
        let (block, next) = after.split_at_checked(usize::from(code.checked_sub(1)?))?;
        to.extend_from_slice(block);
        if *code < 255 && !next.is_empty() {
            to.push(0);
        }
        rest = next;
    }
    Some(())
}

#[cfg(test)]
mod tests {
    use super::super::tests::channels;
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn the_checksum_is_that_of_its_definition() {
        assert_eq!(CRC.checksum(b"123456789"), 0x29B1);
    }

    #[test]
    fn bytes_are_stuffed_as_in_the_paper() {
        let stuffed = |bytes: &[u8]| {
            let mut to = Vec::new();
            stuff(bytes, &mut to);
            to
        };
        assert_eq!(stuffed(&[]), [1]);
        assert_eq!(stuffed(&[0]), [1, 1]);
        assert_eq!(stuffed(&[0x11, 0x22, 0, 0x33]), [3, 0x11, 0x22, 2, 0x33]);
        assert_eq!(stuffed(&[1; 254]).len(), 255);
        assert_eq!(stuffed(&[1; 255]).len(), 257);
        let long: Vec<u8> = (0..HEAD + 4 * 255 + TAIL).map(|i| (i % 255 + 1) as u8).collect();
        assert_eq!(stuffed(&long).len(), LONGEST);
    }

    proptest! {
        #[test]
        fn unstuffing_inverts_stuffing(bytes in prop::collection::vec(prop_oneof![Just(0_u8), any::<u8>()], 0..600)) {
            let (mut stuffed, mut back) = (Vec::new(), Vec::new());
            stuff(&bytes, &mut stuffed);
            prop_assert!(!stuffed.contains(&0));
            prop_assert_eq!(unstuff(&stuffed, &mut back), Some(()));
            prop_assert_eq!(back, bytes);
        }

        #[test]
        fn a_frame_comes_back_and_a_damaged_one_does_not(
            sequence: u32,
            time_us: u32,
            values in prop::collection::vec(-1e30_f32..1e30, 1..256),
            damaged: prop::sample::Index,
            bit in 0..8_u8,
        ) {
            let names: Vec<String> = (0..values.len()).map(|i| format!("s{i}")).collect();
            let names: Vec<&str> = names.iter().map(String::as_str).collect();
            let names = Names::new(&channels(&names));
            let columns: Vec<Role> = (0..values.len()).map(Role::Channel).collect();
            let mut bytes = Vec::new();
            encode_into(&mut bytes, sequence, time_us, &values);
            prop_assert_eq!(bytes.pop(), Some(0));
            let frame = decode(&bytes, &names, &columns, &mut Vec::new()).unwrap();
            prop_assert_eq!(frame.sequence, Some(sequence));
            prop_assert_eq!(frame.device_time, Some(Duration::from_micros(time_us.into())));
            let expected: Vec<f64> = values.iter().map(|value| f64::from(*value)).collect();
            prop_assert_eq!(frame.reading, expected);
            let place = damaged.index(bytes.len());
            bytes[place] ^= 1_u8 << bit;
            prop_assume!(bytes[place] != 0);
            prop_assert!(decode(&bytes, &names, &columns, &mut Vec::new()).is_err());
        }
    }
}
