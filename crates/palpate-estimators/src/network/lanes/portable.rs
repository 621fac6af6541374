//! Lanes as plain arrays: for every machine, and with one lane the arithmetic of the scalar twin.

use super::{Lanes, Table};

/// N numbers in an array. With `FUSED` a multiply-add rounds once, which is fast only where the instruction exists.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Array<T, const N: usize, const FUSED: bool>([T; N]);

/// Calls to `std::array::from_fn` may stay calls; a loop over a filled array never does.
macro_rules! each_lane {
    ($a:expr, $lane:ident => $value:expr) => {{
        let mut result = $a;
        for $lane in 0..N {
            result[$lane] = $value;
        }
        Array(result)
    }};
}

macro_rules! array_lanes {
    ($real:ty, $bits:ty, $shift:expr) => {
        impl<const N: usize, const FUSED: bool> Lanes<N> for Array<$real, N, FUSED> {
            type Real = $real;

            #[inline(always)]
            fn from_array(values: [$real; N]) -> Self {
                Array(values)
            }
            #[inline(always)]
            fn to_array(self) -> [$real; N] {
                self.0
            }
            #[inline(always)]
            fn splat(value: $real) -> Self {
                Array([value; N])
            }
            #[inline(always)]
            fn add(self, other: Self) -> Self {
                each_lane!(self.0, l => self.0[l] + other.0[l])
            }
            #[inline(always)]
            fn sub(self, other: Self) -> Self {
                each_lane!(self.0, l => self.0[l] - other.0[l])
            }
            #[inline(always)]
            fn mul(self, other: Self) -> Self {
                each_lane!(self.0, l => self.0[l] * other.0[l])
            }
            #[inline(always)]
            fn div(self, other: Self) -> Self {
                each_lane!(self.0, l => self.0[l] / other.0[l])
            }
            // The comparisons keep the second operand where the first is not a number, as the x86 instructions do.
            #[inline(always)]
            fn min(self, other: Self) -> Self {
                each_lane!(self.0, l => if self.0[l] < other.0[l] { self.0[l] } else { other.0[l] })
            }
            #[inline(always)]
            fn max(self, other: Self) -> Self {
                each_lane!(self.0, l => if self.0[l] > other.0[l] { self.0[l] } else { other.0[l] })
            }
            #[inline(always)]
            fn mul_add(self, factor: Self, term: Self) -> Self {
                if FUSED {
                    each_lane!(self.0, l => self.0[l].mul_add(factor.0[l], term.0[l]))
                } else {
                    each_lane!(self.0, l => self.0[l] * factor.0[l] + term.0[l])
                }
            }
            #[inline(always)]
            fn mul_sub(self, factor: Self, term: Self) -> Self {
                if FUSED {
                    each_lane!(self.0, l => self.0[l].mul_add(factor.0[l], -term.0[l]))
                } else {
                    each_lane!(self.0, l => self.0[l] * factor.0[l] - term.0[l])
                }
            }
            #[inline(always)]
            fn power_of_two(self) -> Self {
                each_lane!(self.0, l => <$real>::from_bits(self.0[l].to_bits() << $shift))
            }
            #[inline(always)]
            fn look_up(table: &Table<$real>, picks: &[u32; N], values: &mut [Self]) {
                table.look_up_singly(picks, values);
            }
        }
    };
}

array_lanes!(f64, u64, f64::MANTISSA_DIGITS - 1);
array_lanes!(f32, u32, f32::MANTISSA_DIGITS - 1);
