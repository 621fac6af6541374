//! AVX-512: eight f64 or sixteen f32 at a time.
//!
//! Safety of every block here: the types are private to the lanes, and [`super::dispatch`] enters the kernel with
//! them only after `is_x86_feature_detected!` has found AVX-512 F and DQ, so the instructions exist.

use super::Lanes;
use std::arch::x86_64::*;

/// Eight f64.
#[derive(Clone, Copy)]
#[repr(transparent)]
pub(super) struct F64x8(__m512d);

/// Sixteen f32.
#[derive(Clone, Copy)]
#[repr(transparent)]
pub(super) struct F32x16(__m512);

/// A method that is one instruction.
macro_rules! instruction {
    ($name:ident($($operand:ident),*) $intrinsic:ident) => {
        #[inline(always)]
        fn $name(self, $($operand: Self),*) -> Self {
            // SAFETY: see the head of this file.
            Self(unsafe { $intrinsic(self.0, $($operand.0),*) })
        }
    };
}

impl Lanes<8> for F64x8 {
    type Real = f64;
    type Picks = __m512i;

    #[inline(always)]
    fn from_array(values: [f64; 8]) -> Self {
        // SAFETY: see the head of this file; the load is unaligned and the array has eight elements.
        Self(unsafe { _mm512_loadu_pd(values.as_ptr()) })
    }
    #[inline(always)]
    fn to_array(self) -> [f64; 8] {
        let mut values = [0.0; 8];
        // SAFETY: see the head of this file; the store is unaligned and the array has eight elements.
        unsafe { _mm512_storeu_pd(values.as_mut_ptr(), self.0) };
        values
    }
    #[inline(always)]
    fn splat(value: f64) -> Self {
        // SAFETY: see the head of this file.
        Self(unsafe { _mm512_set1_pd(value) })
    }
    instruction!(add(other) _mm512_add_pd);
    instruction!(sub(other) _mm512_sub_pd);
    instruction!(mul(other) _mm512_mul_pd);
    instruction!(div(other) _mm512_div_pd);
    instruction!(min(other) _mm512_min_pd);
    instruction!(max(other) _mm512_max_pd);
    instruction!(mul_add(factor, term) _mm512_fmadd_pd);
    instruction!(mul_sub(factor, term) _mm512_fmsub_pd);
    #[inline(always)]
    fn scale_by_power_of_two(self, shifted: Self) -> Self {
        // SAFETY: see the head of this file.
        Self(unsafe {
            let exponent = _mm512_slli_epi64::<52>(_mm512_castpd_si512(shifted.0));
            _mm512_castsi512_pd(_mm512_add_epi64(_mm512_castpd_si512(self.0), exponent))
        })
    }
    #[inline(always)]
    fn picks(patterns: &[u32; 8]) -> __m512i {
        // SAFETY: see the head of this file; the load is unaligned and the array has eight elements.
        unsafe { _mm512_cvtepu32_epi64(_mm256_loadu_si256(patterns.as_ptr().cast())) }
    }
    #[inline(always)]
    fn lookup(column: &[f64], picks: __m512i) -> Self {
        // Up to 32 values lie in four registers, which two permutes and a blend search faster than a gather.
        let Some((table, _)) = column.split_first_chunk::<32>().filter(|(_, rest)| rest.is_empty()) else {
            return Self::from_array(std::array::from_fn(|l| {
                // SAFETY: a vector of eight 64-bit numbers has the layout of their array.
                let picks: [u64; 8] = unsafe { std::mem::transmute(picks) };
                column[picks[l] as usize]
            }));
        };
        // SAFETY: see the head of this file; the loads are unaligned and lie within the 32 values.
        Self(unsafe {
            let part = |k: usize| _mm512_loadu_pd(table.as_ptr().add(8 * k));
            let low = _mm512_permutex2var_pd(part(0), picks, part(1));
            let high = _mm512_permutex2var_pd(part(2), picks, part(3));
            let upper_half = _mm512_test_epi64_mask(picks, _mm512_set1_epi64(16));
            _mm512_mask_blend_pd(upper_half, low, high)
        })
    }
}

impl Lanes<16> for F32x16 {
    type Real = f32;
    type Picks = __m512i;

    #[inline(always)]
    fn from_array(values: [f32; 16]) -> Self {
        // SAFETY: see the head of this file; the load is unaligned and the array has sixteen elements.
        Self(unsafe { _mm512_loadu_ps(values.as_ptr()) })
    }
    #[inline(always)]
    fn to_array(self) -> [f32; 16] {
        let mut values = [0.0; 16];
        // SAFETY: see the head of this file; the store is unaligned and the array has sixteen elements.
        unsafe { _mm512_storeu_ps(values.as_mut_ptr(), self.0) };
        values
    }
    #[inline(always)]
    fn splat(value: f32) -> Self {
        // SAFETY: see the head of this file.
        Self(unsafe { _mm512_set1_ps(value) })
    }
    instruction!(add(other) _mm512_add_ps);
    instruction!(sub(other) _mm512_sub_ps);
    instruction!(mul(other) _mm512_mul_ps);
    instruction!(div(other) _mm512_div_ps);
    instruction!(min(other) _mm512_min_ps);
    instruction!(max(other) _mm512_max_ps);
    instruction!(mul_add(factor, term) _mm512_fmadd_ps);
    instruction!(mul_sub(factor, term) _mm512_fmsub_ps);
    #[inline(always)]
    fn scale_by_power_of_two(self, shifted: Self) -> Self {
        // SAFETY: see the head of this file.
        Self(unsafe {
            let exponent = _mm512_slli_epi32::<23>(_mm512_castps_si512(shifted.0));
            _mm512_castsi512_ps(_mm512_add_epi32(_mm512_castps_si512(self.0), exponent))
        })
    }
    #[inline(always)]
    fn picks(patterns: &[u32; 16]) -> __m512i {
        // SAFETY: see the head of this file; the load is unaligned and the array has sixteen elements.
        unsafe { _mm512_loadu_si512(patterns.as_ptr().cast()) }
    }
    #[inline(always)]
    fn lookup(column: &[f32], picks: __m512i) -> Self {
        // Up to 32 values lie in two registers, which one permute searches faster than a gather.
        let Some((table, _)) = column.split_first_chunk::<32>().filter(|(_, rest)| rest.is_empty()) else {
            return Self::from_array(std::array::from_fn(|l| {
                // SAFETY: a vector of sixteen 32-bit numbers has the layout of their array.
                let picks: [u32; 16] = unsafe { std::mem::transmute(picks) };
                column[picks[l] as usize]
            }));
        };
        // SAFETY: see the head of this file; the loads are unaligned and lie within the 32 values.
        Self(unsafe {
            let part = |k: usize| _mm512_loadu_ps(table.as_ptr().add(16 * k));
            _mm512_permutex2var_ps(part(0), picks, part(1))
        })
    }
}
