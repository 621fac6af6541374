//! Lanes as plain arrays: for every machine, and the twin that the instruction sets are held against.

use super::{Eight, Number};
use std::ops::{Add, Div, Mul, Sub};

/// Eight numbers in an array.
#[derive(Clone, Copy, Debug)]
pub(in crate::influence) struct Array(pub(super) [f64; 8]);

/// Calls to `std::array::from_fn` may stay calls; a loop over a filled array never does.
macro_rules! each_lane {
    ($a:expr, $lane:ident => $value:expr) => {{
        let mut result = $a;
        for $lane in 0..8 {
            result[$lane] = $value;
        }
        Self(result)
    }};
}

/// An operator, lane by lane.
macro_rules! operator {
    ($operator:ident $name:ident) => {
        impl $operator for Array {
            type Output = Self;
            #[inline(always)]
            fn $name(self, other: Self) -> Self {
                each_lane!(self.0, l => self.0[l].$name(other.0[l]))
            }
        }
    };
}

operator!(Add add);
operator!(Sub sub);
operator!(Mul mul);
operator!(Div div);

impl Number for Array {
    #[inline(always)]
    fn splat(value: f64) -> Self {
        Self([value; 8])
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        each_lane!(self.0, l => Number::max(self.0[l], other.0[l]))
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        each_lane!(self.0, l => Number::min(self.0[l], other.0[l]))
    }
    #[inline(always)]
    fn truncate(self) -> Self {
        each_lane!(self.0, l => self.0[l].trunc())
    }
    #[inline(always)]
    fn at_most(self, other: Self) -> u8 {
        let mut bits = 0;
        for l in 0..8 {
            bits |= self.0[l].at_most(other.0[l]) << l;
        }
        bits
    }
    #[inline(always)]
    fn or(self, bits: u8, other: Self) -> Self {
        each_lane!(self.0, l => self.0[l].or(bits >> l, other.0[l]))
    }
}

impl Eight for Array {
    #[inline(always)]
    fn load(values: &[f64; 8]) -> Self {
        Self(*values)
    }
    #[inline(always)]
    fn store(self, values: &mut [f64; 8]) {
        *values = self.0;
    }
    #[inline(always)]
    fn sum(self) -> f64 {
        let a = self.0;
        ((a[0] + a[4]) + (a[2] + a[6])) + ((a[1] + a[5]) + (a[3] + a[7]))
    }
    #[inline(always)]
    fn sums(eight: &[Self; 8]) -> Self {
        each_lane!([0.0; 8], l => eight[l].sum())
    }
    #[inline(always)]
    fn is_minimum(self, left: Self, right: Self) -> u8 {
        let mut bits = 0;
        for l in 0..8 {
            bits |= u8::from((self.0[l] <= left.0[l]) & (self.0[l] < right.0[l])) << l;
        }
        bits
    }
}
