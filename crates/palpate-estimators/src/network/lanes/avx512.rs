//! AVX-512: eight f64 or sixteen f32 at a time.
//!
//! Safety of every block here: the types are private to the lanes, and [`super::dispatch`] enters the kernel with
//! them only after `is_x86_feature_detected!` has found AVX-512 F and DQ, so the instructions exist.
#![expect(unsafe_code, reason = "intrinsics")]

use super::{Lanes, Table};
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
    fn power_of_two(self) -> Self {
        // SAFETY: see the head of this file.
        Self(unsafe { _mm512_castsi512_pd(_mm512_slli_epi64::<52>(_mm512_castpd_si512(self.0))) })
    }
    #[inline(always)]
    fn look_up(table: &Table<f64>, picks: &[u32; 8], values: &mut [Self]) {
        let Some(columns) = table.short_columns() else {
            return table.look_up_singly(picks, values);
        };
        // Thirty-two values lie in four registers, which two permutes and a blend search faster than a gather.
        // SAFETY: see the head of this file; the loads are unaligned and lie within the eight picks and 32 values.
        unsafe {
            let picks = _mm512_cvtepu32_epi64(_mm256_loadu_si256(picks.as_ptr().cast()));
            let upper_half = _mm512_test_epi64_mask(picks, _mm512_set1_epi64(16));
            for (column, value) in columns.iter().zip(values) {
                let part = |k: usize| _mm512_loadu_pd(column.as_ptr().add(8 * k));
                let low = _mm512_permutex2var_pd(part(0), picks, part(1));
                let high = _mm512_permutex2var_pd(part(2), picks, part(3));
                *value = Self(_mm512_mask_blend_pd(upper_half, low, high));
            }
        }
    }
}

impl Lanes<16> for F32x16 {
    type Real = f32;

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
    fn power_of_two(self) -> Self {
        // SAFETY: see the head of this file.
        Self(unsafe { _mm512_castsi512_ps(_mm512_slli_epi32::<23>(_mm512_castps_si512(self.0))) })
    }
    #[inline(always)]
    fn transpose(rows: &[[f32; 8]; 16]) -> [Self; 8] {
        // SAFETY: see the head of this file; the loads are unaligned, and each takes one of the eight pairs of rows.
        unsafe {
            let pair = |k: usize| _mm512_loadu_ps(rows.as_ptr().add(2 * k).cast());
            let upper = quarters([pair(0), pair(1), pair(2), pair(3)]);
            let lower = quarters([pair(4), pair(5), pair(6), pair(7)]);
            // A quarter of a register holds a column's four numbers of every other row.
            let near = _mm512_setr_epi32(0, 8, 1, 9, 2, 10, 3, 11, 16, 24, 17, 25, 18, 26, 19, 27);
            let far = _mm512_add_epi32(near, _mm512_set1_epi32(4));
            std::array::from_fn(|k| {
                let places = if k < 4 { near } else { far };
                Self(_mm512_permutex2var_ps(upper[k % 4], places, lower[k % 4]))
            })
        }
    }
    #[inline(always)]
    fn look_up(table: &Table<f32>, picks: &[u32; 16], values: &mut [Self]) {
        let Some(columns) = table.short_columns() else {
            return table.look_up_singly(picks, values);
        };
        // Thirty-two values lie in two registers, which one permute searches faster than a gather.
        // SAFETY: see the head of this file; the loads are unaligned and lie within the sixteen picks and 32 values.
        unsafe {
            let picks = _mm512_loadu_si512(picks.as_ptr().cast());
            for (column, value) in columns.iter().zip(values) {
                let part = |k: usize| _mm512_loadu_ps(column.as_ptr().add(16 * k));
                *value = Self(_mm512_permutex2var_ps(part(0), picks, part(1)));
            }
        }
    }
}

/// Transposes the four squares of 4 × 4 numbers that lie side by side in four registers.
///
/// # Safety
/// The machine must have AVX-512 F.
#[inline(always)]
unsafe fn quarters(rows: [__m512; 4]) -> [__m512; 4] {
    // SAFETY: the caller has AVX-512 F.
    unsafe {
        let [a, b, c, d] = rows;
        let (ab_low, ab_high) = (_mm512_unpacklo_ps(a, b), _mm512_unpackhi_ps(a, b));
        let (cd_low, cd_high) = (_mm512_unpacklo_ps(c, d), _mm512_unpackhi_ps(c, d));
        [
            _mm512_shuffle_ps::<0b01_00_01_00>(ab_low, cd_low),
            _mm512_shuffle_ps::<0b11_10_11_10>(ab_low, cd_low),
            _mm512_shuffle_ps::<0b01_00_01_00>(ab_high, cd_high),
            _mm512_shuffle_ps::<0b11_10_11_10>(ab_high, cd_high),
        ]
    }
}
