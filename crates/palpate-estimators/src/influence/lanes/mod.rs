//! Eight numbers at a time, for locating.
//!
//! [`Eight`] is the arithmetic that a search needs. The search is written against it; the instruction sets ([`avx512`],
//! [`avx2`]) and plain arrays ([`portable`]) implement it, and [`dispatch`] picks the widest that the machine has when
//! the program runs. Nothing is fused and sums have one order, so all of these give the same estimates to the last bit.
//!
//! Eight numbers are either eight channels of one reading, or one number each of eight readings. What is done once a
//! reading is written against [`Abreast`]: for one reading it is a plain number, for eight readings it is an [`Eight`].

#[cfg(target_arch = "x86_64")]
mod avx2;
#[cfg(target_arch = "x86_64")]
mod avx512;
mod dispatch;
mod number;
mod portable;

pub(super) use dispatch::locate_rows;
#[cfg(test)]
pub(super) use dispatch::{InstructionSet, locate_rows_by};
pub(super) use number::{Abreast, Number};
pub(super) use portable::Array;

/// Eight numbers side by side. Every operation is lane by lane and rounds as IEEE 754 says.
pub(super) trait Eight: Number {
    fn load(values: &[f64; 8]) -> Self;
    fn store(self, values: &mut [f64; 8]);
    /// ((0 + 4) + (2 + 6)) + ((1 + 5) + (3 + 7)), by lane.
    fn sum(self) -> f64;
    /// [`Eight::sum`] of each.
    fn sums(eight: &[Self; 8]) -> Self;
    /// Bit i is set where lane i is a minimum: at most `left` and below `right`.
    fn is_minimum(self, left: Self, right: Self) -> u8;
}

#[cfg(test)]
mod tests;
