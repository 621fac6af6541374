//! Eight numbers at a time, for locating.
//!
//! [`Eight`] is the arithmetic that a search needs. The search is written against it; the instruction sets ([`avx512`],
//! [`avx2`]) and plain arrays ([`portable`]) implement it, and [`dispatch`] picks the widest that the machine has when
//! the program runs. Nothing is fused and sums have one order, so all of these give the same estimates to the last bit.

#[cfg(target_arch = "x86_64")]
mod avx2;
#[cfg(target_arch = "x86_64")]
mod avx512;
mod dispatch;
mod portable;

pub(super) use dispatch::locate_rows;
#[cfg(test)]
pub(super) use dispatch::{InstructionSet, locate_rows_by};
pub(super) use portable::Array;

/// Eight numbers side by side. Every operation is lane by lane and rounds as IEEE 754 says.
pub(super) trait Eight: Copy {
    fn load(values: &[f64; 8]) -> Self;
    fn store(self, values: &mut [f64; 8]);
    fn splat(value: f64) -> Self;
    fn add(self, other: Self) -> Self;
    fn sub(self, other: Self) -> Self;
    fn mul(self, other: Self) -> Self;
    fn div(self, other: Self) -> Self;
    /// The larger in each lane, of numbers.
    fn max(self, other: Self) -> Self;
    /// ((0 + 4) + (2 + 6)) + ((1 + 5) + (3 + 7)), by lane.
    fn sum(self) -> f64;
    /// Bit i is set where lane i is a minimum: at most `left` and below `right`.
    fn is_minimum(self, left: Self, right: Self) -> u8;
}

#[cfg(test)]
mod tests {
    use super::*;
    use portable::Array;

    /// Numbers of both signs and of many sizes.
    fn numbers(shift: usize) -> [f64; 8] {
        std::array::from_fn(|i| ((i * 7 + shift * 3) as f64 * 1.3).sin() * 10f64.powi((i + shift) as i32 % 5))
    }

    #[cfg(target_arch = "x86_64")]
    #[inline(always)]
    fn agrees<V: Eight>() {
        for shift in 0..40 {
            let (a, b) = (numbers(shift), numbers(shift + 1));
            let (wide, narrow) = ((V::load(&a), V::load(&b)), (Array::load(&a), Array::load(&b)));
            let lanes = |v: V| {
                let mut values = [0.0; 8];
                v.store(&mut values);
                values
            };
            assert_eq!(lanes(wide.0.add(wide.1)), narrow.0.add(narrow.1).0);
            assert_eq!(lanes(wide.0.sub(wide.1)), narrow.0.sub(narrow.1).0);
            assert_eq!(lanes(wide.0.mul(wide.1)), narrow.0.mul(narrow.1).0);
            assert_eq!(lanes(wide.0.div(wide.1)), narrow.0.div(narrow.1).0);
            assert_eq!(lanes(wide.0.max(wide.1)), narrow.0.max(narrow.1).0);
            assert_eq!(lanes(V::splat(a[1])), [a[1]; 8]);
            assert_eq!(wide.0.sum(), narrow.0.sum());
            let third = (V::load(&numbers(shift + 2)), Array::load(&numbers(shift + 2)));
            assert_eq!(wide.0.is_minimum(wide.1, third.0), narrow.0.is_minimum(narrow.1, third.1));
            assert_eq!(wide.0.is_minimum(wide.0, third.0), narrow.0.is_minimum(narrow.0, third.1));
        }
    }

    #[cfg(target_arch = "x86_64")]
    #[test]
    fn every_instruction_set_computes_as_plain_arrays_do() {
        let sets = InstructionSet::available();
        if sets.contains(&InstructionSet::Avx2) {
            agrees::<avx2::F64x8>();
        }
        if sets.contains(&InstructionSet::Avx512) {
            agrees::<avx512::F64x8>();
        }
    }
}
