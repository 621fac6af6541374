use super::whole_record::parse;
use mcap::McapError;
use mcap::records::{Record, op};
use mcap::sans_io::linear_reader::{LinearReadEvent, LinearReader, LinearReaderOptions};
use std::io::Read;

/// Most bytes of a record or an uncompressed chunk.
pub const MOST: u64 = 256 << 20;

/// Fault of an unreadable block.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum BlockFault {
    /// Unknown compression.
    #[error("its compression `{0}` is unknown; known are `lz4`, `zstd` and none")]
    Compression(String),
    /// Wrong checksum.
    #[error("its checksum does not match its bytes")]
    Checksum,
    /// Too many bytes.
    #[error("it has more than {} MiB", MOST >> 20)]
    TooLarge,
    /// Invalid bytes.
    #[error("its bytes are damaged")]
    Damaged,
}

pub fn unpack_chunk(body: &[u8], mut hand_on: impl FnMut(Record)) -> Result<(), BlockFault> {
    let Some(Record::Chunk { header, data }) = parse(op::CHUNK, body) else {
        return Err(BlockFault::Damaged);
    };
    if header.uncompressed_size > MOST {
        return Err(BlockFault::TooLarge);
    }
    // The MCAP reader decodes lz4. For zstd it uses a library in C that takes half a minute to compile; zstd
    // is decoded here instead.
    let (compression, data) = match header.compression.as_str() {
        "zstd" => ("", unpack_zstd(&data, header.uncompressed_size)?),
        other => (other, data.into_owned()),
    };
    // A file of one record, the chunk: the chunk reader of MCAP allocates any length that a damaged record
    // states. Bytes after the data of the chunk are omitted, because the reader would count them as the rest
    // of a record beyond the chunk.
    let mut chunk = Vec::with_capacity(data.len() + 64);
    for number in [header.message_start_time, header.message_end_time, header.uncompressed_size] {
        chunk.extend(number.to_le_bytes());
    }
    chunk.extend(header.uncompressed_crc.to_le_bytes());
    chunk.extend((compression.len() as u32).to_le_bytes());
    chunk.extend(compression.bytes());
    chunk.extend((data.len() as u64).to_le_bytes());
    chunk.extend(data);
    let mut file = vec![op::CHUNK];
    file.extend((chunk.len() as u64).to_le_bytes());
    file.extend(chunk);
    let options = LinearReaderOptions::default()
        .with_skip_start_magic(true)
        .with_skip_end_magic(true)
        .with_validate_chunk_crcs(true)
        .with_record_length_limit(MOST as usize);
    let mut reader = LinearReader::new_with_options(options);
    let mut rest = file.as_slice();
    let mut records = Vec::new();
    while let Some(event) = reader.next_event() {
        match event.map_err(|error| fault_of(&error))? {
            LinearReadEvent::ReadRequest(wanted) => {
                let (next, later) = rest.split_at(wanted.min(rest.len()));
                reader.insert(next.len()).copy_from_slice(next);
                reader.notify_read(next.len());
                rest = later;
            }
            // The checksum is verified at the end of the chunk.
            LinearReadEvent::Record { data, opcode } => {
                records.extend(parse(opcode, data).map(Record::into_owned));
            }
        }
    }
    records.into_iter().for_each(&mut hand_on);
    Ok(())
}

fn fault_of(error: &McapError) -> BlockFault {
    match error {
        McapError::UnsupportedCompression(name) => {
            BlockFault::Compression(name.escape_debug().take(20).collect())
        }
        McapError::BadChunkCrc { .. } => BlockFault::Checksum,
        _ => BlockFault::Damaged,
    }
}

/// The result must have `size` bytes.
fn unpack_zstd(packed: &[u8], size: u64) -> Result<Vec<u8>, BlockFault> {
    let mut decoder = ruzstd::decoding::StreamingDecoder::new(packed).map_err(|_| BlockFault::Damaged)?;
    let mut data = Vec::new();
    // One byte more than `size` reveals a longer frame, without decoding all of it.
    decoder.by_ref().take(size + 1).read_to_end(&mut data).map_err(|_| BlockFault::Damaged)?;
    if data.len() as u64 == size { Ok(data) } else { Err(BlockFault::Damaged) }
}

pub fn read_loose(mut bytes: &[u8], mut hand_on: impl FnMut(Record)) -> Result<(), BlockFault> {
    while let Some((head, rest)) = bytes.split_first_chunk::<9>() {
        let [kind, length @ ..] = head;
        let length = usize::try_from(u64::from_le_bytes(*length)).map_err(|_| BlockFault::Damaged)?;
        let (body, rest) = rest.split_at_checked(length).ok_or(BlockFault::Damaged)?;
        hand_on(parse(*kind, body).ok_or(BlockFault::Damaged)?);
        bytes = rest;
    }
    Ok(())
}
