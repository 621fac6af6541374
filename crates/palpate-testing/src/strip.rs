//! Clamped strip of strain gauges for simulated presses.

/// Clamped strip (300 mm, six noise-free strain gauges), pressed twice with 2 N at ten places.
pub const CLAMPED_STRIP: &str = r#"
[surface]
kind = "beam"
length = "300 mm"
width = "30 mm"
thickness = "1.5 mm"
youngs_modulus = "70 GPa"
supports = [{ at = "0 mm", kind = "clamped" }, { at = "300 mm", kind = "clamped" }]

[sensors]
measure = "strain"
count = 6

[contact]
force = "2 N"

[training]
arrangement = "even"
count = 10
repeats = 2

[estimator]
kind = "influence"
"#;
/// Force of the presses, N.
pub const STRIP_FORCE_N: f64 = 2.0;

/// [`CLAMPED_STRIP`] with noise, µm/m.
pub fn clamped_strip(noise_um_per_m: f64) -> String {
    CLAMPED_STRIP.replace("count = 6", &format!("count = 6\nnoise = \"{noise_um_per_m} um/m\""))
}
