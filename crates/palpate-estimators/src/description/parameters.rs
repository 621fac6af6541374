//! Descriptions of learnt parameters of a surface without a model.

use crate::influence::{DriftCourse, ForceLinearLocator, Scatter, Source, Structure};
use palpate_mechanics::contact::Position;
use palpate_mechanics::units::{format_count, format_length_mm};
use palpate_numerics::regression::Kernel;

/// Describes structure, influence functions, offsets, noise and disturbances.
pub fn parameter_lines(linear: &ForceLinearLocator, names: &[String]) -> Vec<String> {
    let channels =
        linear.channels().map(|(c, offset, noise)| format!("{}: {}", names[c], with_noise(offset, noise)));
    let presses = format_count(linear.presses() as u64);
    let mut lines = vec![
        "reading = offset + force × influence(position), learnt from the recording".to_owned(),
        structure(linear),
        format!("influence functions: {}, from {presses} presses", influences(linear)),
        format!("offset and noise of the channels in use: {}", channels.collect::<Vec<_>>().join(", ")),
    ];
    lines.extend(disturbances(linear, names));
    lines
}

fn with_noise(value: f64, noise: f64) -> String {
    let decimals = decimals(noise, 3);
    format!("{value:.decimals$} ± {noise:.decimals$}")
}

pub(super) fn decimals(value: f64, digits: i32) -> usize {
    if value == 0.0 {
        return 0;
    }
    (f64::from(digits - 1) - value.abs().log10().floor()).clamp(0.0, 15.0) as usize
}

/// Describes structure, drift, scatter and excluded rows.
pub fn summary_lines(linear: &ForceLinearLocator, names: &[String]) -> Vec<String> {
    let mut lines = vec![structure(linear)];
    lines.extend(disturbances(linear, names));
    lines
}

fn structure(linear: &ForceLinearLocator) -> String {
    let exponent = linear.response();
    if let Some(share) = linear.saturation_share() {
        let percent = 100.0 * share;
        return format!(
            "structure: force-saturating; the largest readings are {percent:.1} % below proportion to the force"
        );
    }
    match (linear.asked_structure(), exponent == 1.0) {
        (Structure::Auto, true) => {
            "structure: force-linear, as the presses are not e¹⁰ times as probable with another power of the force, \
             or with influences that change with force and position"
                .to_owned()
        }
        (Structure::Auto, false) => format!(
            "structure: force-monotone; readings follow the force to the power of {exponent:.2}, with which the \
             presses are e¹⁰ times as probable"
        ),
        (Structure::ForceSaturating, true) => {
            "structure: force-linear, as the presses show no saturation".to_owned()
        }
        (_, true) => "structure: force-linear".to_owned(),
        (_, false) => format!(
            "structure: force-monotone; readings follow the force to the power of {exponent:.2}"
        ),
    }
}

fn disturbances(linear: &ForceLinearLocator, names: &[String]) -> Vec<String> {
    let by_channel = |sizes: &[(usize, f64)]| {
        let size = |(c, sd): &(usize, f64)| format!("{} by {:.*}", names[*c], decimals(*sd, 2), sd);
        sizes.iter().map(size).collect::<Vec<_>>().join(", ")
    };
    let mut lines = Vec::new();
    if let Some(course) = linear.drift_course() {
        let course = match course {
            DriftCourse::Walk => "a random walk",
            DriftCourse::Linear => "in proportion to the time",
            DriftCourse::Smooth => "a smooth function of the time",
        };
        let drifts = linear.drifts();
        let sizes = if drifts.is_empty() { String::new() } else { format!(": {}", by_channel(&drifts)) };
        lines.push(format!(
            "drift over the recording, {course}{sizes}; subtracted, and the offsets are those at its end"
        ));
    }
    if let Some(Scatter { force_n, sd }) = linear.scatter() {
        lines.push(format!(
            "scatter of the presses that grows with the force, beside the noise: at {force_n:.2} N, {}; presses are weighted by it",
            by_channel(&sd)
        ));
    }
    if let Some([(least, quiet), (most, noisy)]) = linear.noise_by_place() {
        let place = |position: Position| linear.extent().place_in_words(position);
        lines.push(format!(
            "noise of contacts by position, over that of the untouched surface: {least:.1} times at {} to {most:.1} times at {}; presses and readings are weighted by it",
            place(quiet),
            place(noisy)
        ));
    }
    if linear.noise_is_hardly_told() {
        lines.push(noise_is_hardly_told(linear.presses()));
    }
    if !linear.identifies_untouched() {
        lines.push(
            "the offsets are undetermined by about the size of contact readings: no reading is `no_contact` unless some rows are recorded untouched (force 0)"
                .to_owned(),
        );
    }
    if !linear.set_aside().is_empty() {
        lines.push(format!(
            "outliers, excluded because no function of the position explains them: {}",
            rows(linear.set_aside())
        ));
    }
    lines
}

/// Returns the warning for too few repeats.
pub fn noise_is_hardly_told(presses: usize) -> String {
    let presses = format_count(presses as u64);
    format!(
        "{presses} presses with too few repeats: the noise estimate is unreliable, about a hundredth of the change by a press; press one position three times, or record untouched rows (force 0)"
    )
}

fn rows(from_0: &[usize]) -> String {
    let numbers: Vec<String> = from_0.iter().map(|row| (row + 1).to_string()).collect();
    format!("{} {}", if numbers.len() == 1 { "row" } else { "rows" }, numbers.join(", "))
}

fn influences(linear: &ForceLinearLocator) -> String {
    let smooth = linear.correlation().map(|(kernel, lengths_m)| {
        let lengths: Vec<String> = lengths_m.iter().map(|length_m| format_length_mm(*length_m)).collect();
        let kernel = match kernel {
            Kernel::Matern32 => "Matérn 3/2",
            Kernel::Matern52 => "Matérn 5/2",
            Kernel::SquaredExponential => "squared exponential",
        };
        format!("Gaussian process, {kernel}, length scale {}", lengths.join(" and "))
    });
    let Some(source) = linear.source() else { return smooth.unwrap_or_default() };
    let kind = match source {
        Source::Strain => "strain",
        Source::Slope => "slope",
        Source::Deflection => "deflection",
    };
    let rest = smooth.map(|smooth| format!(", and {smooth}")).unwrap_or_default();
    format!("those of {kind} sensors at positions estimated from the presses, polynomials{rest}")
}

#[cfg(test)]
mod tests {
    use super::{decimals, with_noise};

    #[test]
    fn noise_has_three_digits_of_any_size() {
        assert_eq!(with_noise(282.5181, 1.0234), "282.52 ± 1.02");
        assert_eq!(with_noise(0.000_123_4, 0.002_011), "0.00012 ± 0.00201");
        assert_eq!(with_noise(51_234.6, 1234.5), "51235 ± 1234");
        // A walk of a few microstrain, and a walk of 0.
        assert_eq!([decimals(3.2e-6, 2), decimals(0.0, 2)], [7, 0]);
    }
}
