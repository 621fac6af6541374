//! AVX2: eight f64 in two registers.
//!
//! Safety of every block here: the type is private to the lanes, and [`super::dispatch`] enters the search with it only
//! after `is_x86_feature_detected!` has found AVX2, so the instructions exist.

use super::Eight;
use std::arch::x86_64::*;

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
    fn splat(value: f64) -> Self {
        // SAFETY: see the head of this file.
        let four = unsafe { _mm256_set1_pd(value) };
        Self(four, four)
    }
    instruction!(add _mm256_add_pd);
    instruction!(sub _mm256_sub_pd);
    instruction!(mul _mm256_mul_pd);
    instruction!(div _mm256_div_pd);
    instruction!(max _mm256_max_pd);
    #[inline(always)]
    fn sum(self) -> f64 {
        // SAFETY: see the head of this file.
        unsafe { sum_of_four(_mm256_add_pd(self.0, self.1)) }
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
            (_mm256_movemask_pd(low) | _mm256_movemask_pd(high) << 4) as u8
        }
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
