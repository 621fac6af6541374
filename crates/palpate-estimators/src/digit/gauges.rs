//! The gauges that take part in one estimate, and the stretches between them.

use palpate_mechanics::sensing::{Layout, Sensor};

/// A gauge that reads within its range.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Gauge {
    pub at_m: f64,
    /// Standard deviation of its noise and quantisation: √(σ² + step²/12).
    pub sd: f64,
    /// Its reading, a strain.
    pub strain: f64,
}

/// Contacts that the same gauges see: the first `seeing` of them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Stretch {
    pub seeing: usize,
    pub from_m: f64,
    pub to_m: f64,
}

/// The gauges of a reading from clamp to tip, without dead and saturated ones.
pub(super) fn gauges(layout: &Layout, reading: &[f64]) -> Vec<Gauge> {
    let inside = |(sensor, strain): &(&Sensor, f64)| {
        !sensor.channel.dead && sensor.channel.range.is_none_or(|(low, high)| low < *strain && *strain < high)
    };
    let gauge = |(sensor, strain): (&Sensor, f64)| Gauge {
        at_m: sensor.position.x_m,
        sd: sensor.channel.reading_sd(),
        strain,
    };
    let mut gauges: Vec<Gauge> =
        layout.sensors.iter().zip(reading.iter().copied()).filter(inside).map(gauge).collect();
    gauges.sort_by(|a, b| a.at_m.total_cmp(&b.at_m));
    gauges
}

/// The stretches on which at least one gauge sees a contact, from clamp to tip.
pub(super) fn stretches(gauges: &[Gauge], length_m: f64) -> Vec<Stretch> {
    let end = |i: usize| gauges.get(i).map_or(length_m, |gauge| gauge.at_m);
    let stretch = |i: usize| Stretch { seeing: i + 1, from_m: gauges[i].at_m, to_m: end(i + 1) };
    // Gauges at one place have no stretch between them.
    (0..gauges.len()).map(stretch).filter(|it| it.to_m - it.from_m > 1e-9 * length_m).collect()
}
