//! AVX-512: eight f64 in a register.
//!
//! Safety of every block here: the type is private to the lanes, and [`super::dispatch`] enters the search with it only
//! after `is_x86_feature_detected!` has found AVX-512 F and DQ, so the instructions exist.

use super::Eight;
use std::arch::x86_64::*;

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
    fn splat(value: f64) -> Self {
        // SAFETY: see the head of this file.
        Self(unsafe { _mm512_set1_pd(value) })
    }
    instruction!(add _mm512_add_pd);
    instruction!(sub _mm512_sub_pd);
    instruction!(mul _mm512_mul_pd);
    instruction!(div _mm512_div_pd);
    instruction!(max _mm512_max_pd);
    #[inline(always)]
    fn sum(self) -> f64 {
        // SAFETY: see the head of this file.
        unsafe {
            let halves = _mm256_add_pd(_mm512_castpd512_pd256(self.0), _mm512_extractf64x4_pd::<1>(self.0));
            super::avx2::sum_of_four(halves)
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
