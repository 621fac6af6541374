//! Quantities in SI units, from the units in which people give them: `mm(400.0)` is 0.4 (metres).

/// Metres from millimetres.
pub const fn mm(length: f64) -> f64 {
    length * 1e-3
}

/// Metres from micrometres.
pub const fn um(length: f64) -> f64 {
    length * 1e-6
}

/// Newtons; says what the number is.
pub const fn newtons(force: f64) -> f64 {
    force
}

/// Pascals from gigapascals.
pub const fn gpa(modulus: f64) -> f64 {
    modulus * 1e9
}

/// Pascals from megapascals.
pub const fn mpa(modulus: f64) -> f64 {
    modulus * 1e6
}

/// Strain from microstrain.
pub const fn microstrain(strain: f64) -> f64 {
    strain * 1e-6
}
