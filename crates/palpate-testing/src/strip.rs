//! A clamped strip of strain gauges, which simulated hands press.

/// Rig of a clamped strip of 300 mm with six strain gauges without noise, pressed twice with 2 N at each of ten places.
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
/// Force of its presses, in newtons.
pub const STRIP_FORCE_N: f64 = 2.0;

/// The rig of [`CLAMPED_STRIP`] with a noise in µm/m.
pub fn clamped_strip(noise_um_per_m: f64) -> String {
    CLAMPED_STRIP.replace("count = 6", &format!("count = 6\nnoise = \"{noise_um_per_m} um/m\""))
}
