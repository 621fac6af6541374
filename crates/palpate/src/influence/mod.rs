//! Locating by influence functions: what each sensor reads as a function of where the surface is touched, inverted.

pub mod measured;
