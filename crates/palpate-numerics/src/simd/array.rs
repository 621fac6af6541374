//! Portable vectors, and reference of the vectors made of instructions.

use super::{Arithmetic, EightLanes, Number, Real, Vector};
use std::ops::{Add, Div, Mul, Sub};

/// N numbers. With `FUSED` a multiply-add rounds once.
#[derive(Clone, Copy, Debug)]
pub struct Array<R, const N: usize, const FUSED: bool>([R; N]);

/// `std::array::from_fn` may not be inlined; this loop has no calls.
macro_rules! each_lane {
    ($any:expr, $lane:ident => $value:expr) => {{
        let mut lanes = $any.0;
        for $lane in 0..lanes.len() {
            lanes[$lane] = $value;
        }
        Self(lanes)
    }};
}

macro_rules! operator {
    ($operator:ident $name:ident) => {
        impl<R: Real, const N: usize, const FUSED: bool> $operator for Array<R, N, FUSED> {
            type Output = Self;
            #[inline(always)]
            fn $name(self, other: Self) -> Self {
                each_lane!(self, l => self.0[l].$name(other.0[l]))
            }
        }
    };
}

operator!(Add add);
operator!(Sub sub);
operator!(Mul mul);
operator!(Div div);

impl<R: Real, const N: usize, const FUSED: bool> Arithmetic for Array<R, N, FUSED> {
    type Real = R;
    #[inline(always)]
    fn splat(value: R) -> Self {
        Self([value; N])
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        each_lane!(self, l => if self.0[l] > other.0[l] { self.0[l] } else { other.0[l] })
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        each_lane!(self, l => if self.0[l] < other.0[l] { self.0[l] } else { other.0[l] })
    }
}

impl<R: Real, const N: usize, const FUSED: bool> Vector<N> for Array<R, N, FUSED> {
    #[inline(always)]
    fn load(values: &[R; N]) -> Self {
        Self(*values)
    }
    #[inline(always)]
    fn to_array(self) -> [R; N] {
        self.0
    }
    #[inline(always)]
    fn mul_add(self, factor: Self, term: Self) -> Self {
        if FUSED {
            each_lane!(self, l => self.0[l].fused_mul_add(factor.0[l], term.0[l]))
        } else {
            each_lane!(self, l => self.0[l] * factor.0[l] + term.0[l])
        }
    }
    #[inline(always)]
    fn mul_sub(self, factor: Self, term: Self) -> Self {
        if FUSED {
            each_lane!(self, l => self.0[l].fused_mul_add(factor.0[l], -term.0[l]))
        } else {
            each_lane!(self, l => self.0[l] * factor.0[l] - term.0[l])
        }
    }
    #[inline(always)]
    fn square_root(self) -> Self {
        each_lane!(self, l => self.0[l].square_root())
    }
    #[inline(always)]
    fn power_of_two(self) -> Self {
        each_lane!(self, l => self.0[l].power_of_two())
    }
}

impl<const FUSED: bool> Number for Array<f64, 8, FUSED> {
    #[inline(always)]
    fn truncate(self) -> Self {
        each_lane!(self, l => self.0[l].trunc())
    }
    #[inline(always)]
    fn at_most(self, other: Self) -> u8 {
        (0..8).fold(0, |bits, l| bits | u8::from(self.0[l] <= other.0[l]) << l)
    }
    #[inline(always)]
    fn or(self, bits: u8, other: Self) -> Self {
        each_lane!(self, l => self.0[l].or(bits >> l, other.0[l]))
    }
}

impl<const FUSED: bool> EightLanes for Array<f64, 8, FUSED> {
    #[inline(always)]
    fn below(self, other: Self) -> u8 {
        (0..8).fold(0, |bits, l| bits | u8::from(self.0[l] < other.0[l]) << l)
    }
}
