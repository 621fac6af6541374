//! AVX2: eight f64 in two registers.
//!
//! Safety of every block here: the type is private to the lanes, and [`super::dispatch`] enters the search with it only
//! after `is_x86_feature_detected!` has found AVX2, so the instructions exist.
#![expect(unsafe_code, reason = "intrinsics")]

use super::{Eight, Number};
use std::arch::x86_64::*;
use std::ops::{Add, Div, Mul, Sub};

/// Eight f64.
#[derive(Clone, Copy)]
pub(super) struct F64x8(__m256d, __m256d);

/// A method that is one instruction on each half.
macro_rules! instruction {
    ($name:ident $intrinsic:ident) => {
        #[inline(always)]
        fn $name(self, other: Self) -> Self {
            // SAFETY: see the head of this file.
            unsafe { Self($intrinsic(self.0, other.0), $intrinsic(self.1, other.1)) }
        }
    };
}

/// An operator that is one instruction on each half.
macro_rules! operator {
    ($operator:ident $name:ident $intrinsic:ident) => {
        impl $operator for F64x8 {
            type Output = Self;
            instruction!($name $intrinsic);
        }
    };
}

operator!(Add add _mm256_add_pd);
operator!(Sub sub _mm256_sub_pd);
operator!(Mul mul _mm256_mul_pd);
operator!(Div div _mm256_div_pd);

impl Number for F64x8 {
    #[inline(always)]
    fn splat(value: f64) -> Self {
        // SAFETY: see the head of this file.
        let four = unsafe { _mm256_set1_pd(value) };
        Self(four, four)
    }
    instruction!(max _mm256_max_pd);
    instruction!(min _mm256_min_pd);
    #[inline(always)]
    fn truncate(self) -> Self {
        const TO_ZERO: i32 = _MM_FROUND_TO_ZERO | _MM_FROUND_NO_EXC;
        // SAFETY: see the head of this file.
        unsafe { Self(_mm256_round_pd::<TO_ZERO>(self.0), _mm256_round_pd::<TO_ZERO>(self.1)) }
    }
    #[inline(always)]
    fn at_most(self, other: Self) -> u8 {
        // SAFETY: see the head of this file.
        unsafe {
            bits(_mm256_cmp_pd::<_CMP_LE_OQ>(self.0, other.0), _mm256_cmp_pd::<_CMP_LE_OQ>(self.1, other.1))
        }
    }
    #[inline(always)]
    fn or(self, bits: u8, other: Self) -> Self {
        // SAFETY: see the head of this file.
        unsafe {
            Self(
                _mm256_blendv_pd(other.0, self.0, lanes_of::<1>(bits)),
                _mm256_blendv_pd(other.1, self.1, lanes_of::<16>(bits)),
            )
        }
    }
}

impl Eight for F64x8 {
    #[inline(always)]
    fn load(values: &[f64; 8]) -> Self {
        // SAFETY: see the head of this file; the loads are unaligned and the array has eight elements.
        unsafe { Self(_mm256_loadu_pd(values.as_ptr()), _mm256_loadu_pd(values.as_ptr().add(4))) }
    }
    #[inline(always)]
    fn store(self, values: &mut [f64; 8]) {
        // SAFETY: see the head of this file; the stores are unaligned and the array has eight elements.
        unsafe {
            _mm256_storeu_pd(values.as_mut_ptr(), self.0);
            _mm256_storeu_pd(values.as_mut_ptr().add(4), self.1);
        }
    }
    #[inline(always)]
    fn sum(self) -> f64 {
        // SAFETY: see the head of this file.
        unsafe { sum_of_four(_mm256_add_pd(self.0, self.1)) }
    }
    #[inline(always)]
    fn sums(eight: &[Self; 8]) -> Self {
        // SAFETY: see the head of this file.
        unsafe {
            // ((0 + 4) + (2 + 6), (1 + 5) + (3 + 7)), of a and of b.
            let quarters = |a: usize, b: usize| {
                let a = _mm256_add_pd(eight[a].0, eight[a].1);
                let b = _mm256_add_pd(eight[b].0, eight[b].1);
                _mm256_add_pd(_mm256_permute2f128_pd::<0x20>(a, b), _mm256_permute2f128_pd::<0x31>(a, b))
            };
            let four = |even: __m256d, odd: __m256d| {
                _mm256_add_pd(_mm256_unpacklo_pd(even, odd), _mm256_unpackhi_pd(even, odd))
            };
            Self(four(quarters(0, 2), quarters(1, 3)), four(quarters(4, 6), quarters(5, 7)))
        }
    }
    #[inline(always)]
    fn is_minimum(self, left: Self, right: Self) -> u8 {
        // SAFETY: see the head of this file.
        unsafe {
            let low = _mm256_and_pd(
                _mm256_cmp_pd::<_CMP_LE_OQ>(self.0, left.0),
                _mm256_cmp_pd::<_CMP_LT_OQ>(self.0, right.0),
            );
            let high = _mm256_and_pd(
                _mm256_cmp_pd::<_CMP_LE_OQ>(self.1, left.1),
                _mm256_cmp_pd::<_CMP_LT_OQ>(self.1, right.1),
            );
            bits(low, high)
        }
    }
}

/// A bit for each lane of two registers.
///
/// # Safety
/// The machine must have AVX2.
#[inline(always)]
unsafe fn bits(low: __m256d, high: __m256d) -> u8 {
    // SAFETY: the caller has AVX2.
    unsafe { (_mm256_movemask_pd(low) | _mm256_movemask_pd(high) << 4) as u8 }
}

/// Four lanes, all bits set where their bit is: the lanes of bits FIRST, 2·FIRST, 4·FIRST and 8·FIRST.
///
/// # Safety
/// The machine must have AVX2.
#[inline(always)]
unsafe fn lanes_of<const FIRST: i64>(bits: u8) -> __m256d {
    // SAFETY: the caller has AVX2.
    unsafe {
        let each = _mm256_setr_epi64x(FIRST, 2 * FIRST, 4 * FIRST, 8 * FIRST);
        let set = _mm256_and_si256(_mm256_set1_epi64x(i64::from(bits)), each);
        _mm256_castsi256_pd(_mm256_cmpeq_epi64(set, each))
    }
}

/// (0 + 2) + (1 + 3), by lane.
///
/// # Safety
/// The machine must have AVX2.
#[inline(always)]
pub(super) unsafe fn sum_of_four(four: __m256d) -> f64 {
    // SAFETY: the caller has AVX2.
    unsafe {
        let pair = _mm_add_pd(_mm256_castpd256_pd128(four), _mm256_extractf128_pd::<1>(four));
        _mm_cvtsd_f64(_mm_add_sd(pair, _mm_unpackhi_pd(pair, pair)))
    }
}
