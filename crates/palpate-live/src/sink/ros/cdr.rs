//! ROS 2 messages in Common Data Representation (CDR, OMG DDSI-RTPS 2.5, section 10), version 1,
//! little-endian.

/// Encapsulation: plain CDR, little-endian, no options.
const HEAD: [u8; 4] = [0x00, 0x01, 0x00, 0x00];

/// `geometry_msgs/msg/PointStamped`.
pub fn point_stamped(unix_ns: u64, frame: &str, point_m: [f64; 3]) -> Vec<u8> {
    let mut writer = Writer::new();
    writer.header(unix_ns, frame);
    writer.floats(&point_m);
    writer.bytes
}

/// `geometry_msgs/msg/WrenchStamped`.
pub fn wrench_stamped(unix_ns: u64, frame: &str, force_n: [f64; 3], torque_nm: [f64; 3]) -> Vec<u8> {
    let mut writer = Writer::new();
    writer.header(unix_ns, frame);
    writer.floats(&force_n);
    writer.floats(&torque_nm);
    writer.bytes
}

/// `std_msgs/msg/String`.
pub fn string(text: &str) -> Vec<u8> {
    let mut writer = Writer::new();
    writer.string(text);
    writer.bytes
}

struct Writer {
    bytes: Vec<u8>,
}

impl Writer {
    fn new() -> Self {
        Self { bytes: HEAD.to_vec() }
    }

    /// `std_msgs/msg/Header`.
    fn header(&mut self, unix_ns: u64, frame: &str) {
        // The time of ROS ends in January 2038.
        let seconds = i32::try_from(unix_ns / 1_000_000_000).unwrap_or(i32::MAX);
        self.four(seconds.to_le_bytes());
        self.four(((unix_ns % 1_000_000_000) as u32).to_le_bytes());
        self.string(frame);
    }

    /// The length includes the final zero.
    fn string(&mut self, text: &str) {
        self.four((text.len() as u32 + 1).to_le_bytes());
        self.bytes.extend(text.as_bytes());
        self.bytes.push(0);
    }

    fn floats(&mut self, values: &[f64]) {
        self.align(8);
        values.iter().for_each(|value| self.bytes.extend(value.to_le_bytes()));
    }

    fn four(&mut self, bytes: [u8; 4]) {
        self.align(4);
        self.bytes.extend(bytes);
    }

    /// Pads relative to the end of the encapsulation.
    fn align(&mut self, size: usize) {
        let end = HEAD.len() + (self.bytes.len() - HEAD.len()).next_multiple_of(size);
        self.bytes.resize(end, 0);
    }
}
