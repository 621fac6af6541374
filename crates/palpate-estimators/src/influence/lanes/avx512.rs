//! AVX-512: eight f64 in a register.
//!
//! Safety of every block here: the type is private to the lanes, and [`super::dispatch`] enters the search with it only
//! after `is_x86_feature_detected!` has found AVX-512 F and DQ, so the instructions exist.
#![expect(unsafe_code, reason = "intrinsics")]

use super::{Eight, Number};
use std::arch::x86_64::*;
use std::ops::{Add, Div, Mul, Sub};

/// Eight f64.
#[derive(Clone, Copy)]
#[repr(transparent)]
pub(super) struct F64x8(__m512d);

/// A method that is one instruction.
macro_rules! instruction {
    ($name:ident $intrinsic:ident) => {
        #[inline(always)]
        fn $name(self, other: Self) -> Self {
            // SAFETY: see the head of this file.
            Self(unsafe { $intrinsic(self.0, other.0) })
        }
    };
}

/// An operator that is one instruction.
macro_rules! operator {
    ($operator:ident $name:ident $intrinsic:ident) => {
        impl $operator for F64x8 {
            type Output = Self;
            instruction!($name $intrinsic);
        }
    };
}

operator!(Add add _mm512_add_pd);
operator!(Sub sub _mm512_sub_pd);
operator!(Mul mul _mm512_mul_pd);
operator!(Div div _mm512_div_pd);

impl Number for F64x8 {
    #[inline(always)]
    fn splat(value: f64) -> Self {
        // SAFETY: see the head of this file.
        Self(unsafe { _mm512_set1_pd(value) })
    }
    instruction!(max _mm512_max_pd);
    instruction!(min _mm512_min_pd);
    #[inline(always)]
    fn truncate(self) -> Self {
        // SAFETY: see the head of this file.
        Self(unsafe { _mm512_roundscale_pd::<{ _MM_FROUND_TO_ZERO | _MM_FROUND_NO_EXC }>(self.0) })
    }
    #[inline(always)]
    fn at_most(self, other: Self) -> u8 {
        // SAFETY: see the head of this file.
        unsafe { _mm512_cmp_pd_mask::<_CMP_LE_OQ>(self.0, other.0) }
    }
    #[inline(always)]
    fn or(self, bits: u8, other: Self) -> Self {
        // SAFETY: see the head of this file.
        Self(unsafe { _mm512_mask_blend_pd(bits, other.0, self.0) })
    }
}

impl Eight for F64x8 {
    #[inline(always)]
    fn load(values: &[f64; 8]) -> Self {
        // SAFETY: see the head of this file; the load is unaligned and the array has eight elements.
        Self(unsafe { _mm512_loadu_pd(values.as_ptr()) })
    }
    #[inline(always)]
    fn store(self, values: &mut [f64; 8]) {
        // SAFETY: see the head of this file; the store is unaligned and the array has eight elements.
        unsafe { _mm512_storeu_pd(values.as_mut_ptr(), self.0) };
    }
    #[inline(always)]
    fn sum(self) -> f64 {
        // SAFETY: see the head of this file.
        unsafe {
            let halves = _mm256_add_pd(_mm512_castpd512_pd256(self.0), _mm512_extractf64x4_pd::<1>(self.0));
            super::avx2::sum_of_four(halves)
        }
    }
    #[inline(always)]
    fn sums(eight: &[Self; 8]) -> Self {
        // SAFETY: see the head of this file.
        unsafe {
            // (0 + 4, 1 + 5, 2 + 6, 3 + 7), of a and of b.
            let halves = |a: usize, b: usize| {
                let (a, b) = (eight[a].0, eight[b].0);
                _mm512_add_pd(_mm512_shuffle_f64x2::<0x44>(a, b), _mm512_shuffle_f64x2::<0xee>(a, b))
            };
            // ((0 + 4) + (2 + 6), (1 + 5) + (3 + 7)), of four.
            let quarters = |ab: __m512d, cd: __m512d| {
                _mm512_add_pd(_mm512_shuffle_f64x2::<0x88>(ab, cd), _mm512_shuffle_f64x2::<0xdd>(ab, cd))
            };
            let even = quarters(halves(0, 2), halves(4, 6));
            let odd = quarters(halves(1, 3), halves(5, 7));
            Self(_mm512_add_pd(_mm512_unpacklo_pd(even, odd), _mm512_unpackhi_pd(even, odd)))
        }
    }
    #[inline(always)]
    fn is_minimum(self, left: Self, right: Self) -> u8 {
        // SAFETY: see the head of this file.
        unsafe {
            _mm512_cmp_pd_mask::<_CMP_LE_OQ>(self.0, left.0)
                & _mm512_cmp_pd_mask::<_CMP_LT_OQ>(self.0, right.0)
        }
    }
}
