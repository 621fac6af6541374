//! ROS messages of samples and events.
//!
//! Points and wrenches have no status. Therefore they exist for located contacts only, with a zero wrench for
//! an untouched surface.

use super::cdr;
use super::keys::Topic;
use crate::frame::Channel;
use crate::sample::{Sample, SampleRecord};
use crate::session::Output;
use palpate_core::{ContactEstimate, Estimate, Status};
use palpate_mechanics::surface::Extent;
use serde::Serialize;

/// Message for publication.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RosMessage {
    /// Topic.
    pub topic: Topic,
    /// Unix time in ns.
    pub unix_ns: u64,
    /// CDR with its encapsulation.
    pub cdr: Vec<u8>,
}

/// Messages of an output.
///
/// The origin is the left end or the lower left corner; x points along, y across, z out of the surface.
/// Contacts press along −z; the torque is about the origin.
pub fn messages(output: &Output, frame: &str, channels: &[Channel], extent: Extent) -> Vec<RosMessage> {
    match output {
        Output::Sample(sample) => of_sample(sample, frame, &SampleRecord::new(sample, channels, extent)),
        Output::Event(event) => text(Topic::Event, (event.time_s * 1e9) as u64, event).into_iter().collect(),
    }
}

fn of_sample(sample: &Sample, frame: &str, record: &SampleRecord) -> Vec<RosMessage> {
    let (estimate, unix_ns) = (&sample.estimate, sample.unix_ns);
    let point = (estimate.status == Status::Located).then(|| {
        let position = estimate.contact.position;
        let cdr = cdr::point_stamped(unix_ns, frame, [position.x_m, position.y_m, 0.0]);
        RosMessage { topic: Topic::Contact, unix_ns, cdr }
    });
    let wrench = wrench(estimate).map(|(force_n, torque_nm)| {
        let cdr = cdr::wrench_stamped(unix_ns, frame, force_n, torque_nm);
        RosMessage { topic: Topic::Wrench, unix_ns, cdr }
    });
    let all = [point, wrench, text(Topic::Estimate, unix_ns, record)];
    all.into_iter().flatten().collect()
}

/// Force in N and torque in N·m, if known.
fn wrench(estimate: &Estimate) -> Option<([f64; 3], [f64; 3])> {
    match estimate.status {
        Status::NoContact => Some(([0.0; 3], [0.0; 3])),
        Status::Located => {
            let (mut force_n, mut torque_nm) = ([0.0; 3], [0.0; 3]);
            for ContactEstimate { position, force_n: pressed_n, .. } in
                std::iter::once(&estimate.contact).chain(estimate.further.as_slice())
            {
                let z_n = -(*pressed_n)?;
                force_n[2] += z_n;
                // r × f with r = (x, y, 0) and f = (0, 0, z).
                torque_nm[0] += position.y_m * z_n;
                torque_nm[1] -= position.x_m * z_n;
            }
            Some((force_n, torque_nm))
        }
        Status::Ambiguous | Status::OutsideModel | Status::OutsideSurface => None,
    }
}

fn text(topic: Topic, unix_ns: u64, record: &impl Serialize) -> Option<RosMessage> {
    // Serialization cannot fail: records have only keys of text, and no value that JSON rejects.
    let json = serde_json::to_string(record).ok()?;
    Some(RosMessage { topic, unix_ns, cdr: cdr::string(&json) })
}
