//! AVX2 with FMA: four f64 or eight f32 at a time.
//!
//! Safety of every block here: the types are private to the lanes, and [`super::dispatch`] enters the kernel with
//! them only after `is_x86_feature_detected!` has found AVX2 and FMA, so the instructions exist.
#![expect(unsafe_code, reason = "intrinsics")]

use super::{Lanes, Table};
use std::arch::x86_64::*;

/// Four f64.
#[derive(Clone, Copy)]
#[repr(transparent)]
pub(super) struct F64x4(__m256d);

/// Eight f32.
#[derive(Clone, Copy)]
#[repr(transparent)]
pub(super) struct F32x8(__m256);

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

impl Lanes<4> for F64x4 {
    type Real = f64;

    #[inline(always)]
    fn from_array(values: [f64; 4]) -> Self {
        // SAFETY: see the head of this file; the load is unaligned and the array has four elements.
        Self(unsafe { _mm256_loadu_pd(values.as_ptr()) })
    }
    #[inline(always)]
    fn to_array(self) -> [f64; 4] {
        let mut values = [0.0; 4];
        // SAFETY: see the head of this file; the store is unaligned and the array has four elements.
        unsafe { _mm256_storeu_pd(values.as_mut_ptr(), self.0) };
        values
    }
    #[inline(always)]
    fn splat(value: f64) -> Self {
        // SAFETY: see the head of this file.
        Self(unsafe { _mm256_set1_pd(value) })
    }
    instruction!(add(other) _mm256_add_pd);
    instruction!(sub(other) _mm256_sub_pd);
    instruction!(mul(other) _mm256_mul_pd);
    instruction!(div(other) _mm256_div_pd);
    instruction!(min(other) _mm256_min_pd);
    instruction!(max(other) _mm256_max_pd);
    instruction!(mul_add(factor, term) _mm256_fmadd_pd);
    instruction!(mul_sub(factor, term) _mm256_fmsub_pd);
    #[inline(always)]
    fn power_of_two(self) -> Self {
        // SAFETY: see the head of this file.
        Self(unsafe { _mm256_castsi256_pd(_mm256_slli_epi64::<52>(_mm256_castpd_si256(self.0))) })
    }
    #[inline(always)]
    fn look_up(table: &Table<f64>, picks: &[u32; 4], values: &mut [Self]) {
        table.look_up_singly(picks, values);
    }
}

impl Lanes<8> for F32x8 {
    type Real = f32;

    #[inline(always)]
    fn from_array(values: [f32; 8]) -> Self {
        // SAFETY: see the head of this file; the load is unaligned and the array has eight elements.
        Self(unsafe { _mm256_loadu_ps(values.as_ptr()) })
    }
    #[inline(always)]
    fn to_array(self) -> [f32; 8] {
        let mut values = [0.0; 8];
        // SAFETY: see the head of this file; the store is unaligned and the array has eight elements.
        unsafe { _mm256_storeu_ps(values.as_mut_ptr(), self.0) };
        values
    }
    #[inline(always)]
    fn splat(value: f32) -> Self {
        // SAFETY: see the head of this file.
        Self(unsafe { _mm256_set1_ps(value) })
    }
    instruction!(add(other) _mm256_add_ps);
    instruction!(sub(other) _mm256_sub_ps);
    instruction!(mul(other) _mm256_mul_ps);
    instruction!(div(other) _mm256_div_ps);
    instruction!(min(other) _mm256_min_ps);
    instruction!(max(other) _mm256_max_ps);
    instruction!(mul_add(factor, term) _mm256_fmadd_ps);
    instruction!(mul_sub(factor, term) _mm256_fmsub_ps);
    #[inline(always)]
    fn power_of_two(self) -> Self {
        // SAFETY: see the head of this file.
        Self(unsafe { _mm256_castsi256_ps(_mm256_slli_epi32::<23>(_mm256_castps_si256(self.0))) })
    }
    #[inline(always)]
    fn transpose(rows: &[[f32; 8]; 8]) -> [Self; 8] {
        let mut columns = [Self::splat(0.0); 8];
        for half in 0..2 {
            // SAFETY: see the head of this file; the loads are unaligned, and each takes one half of one row.
            unsafe {
                let part = |k: usize| _mm_loadu_ps(rows[k].as_ptr().add(4 * half));
                let rows = |k: usize| _mm256_insertf128_ps::<1>(_mm256_castps128_ps256(part(k)), part(k + 4));
                let (low, high) = (|a, b| _mm256_unpacklo_ps(a, b), |a, b| _mm256_unpackhi_ps(a, b));
                let (ab_low, ab_high) = (low(rows(0), rows(1)), high(rows(0), rows(1)));
                let (cd_low, cd_high) = (low(rows(2), rows(3)), high(rows(2), rows(3)));
                columns[4 * half] = Self(_mm256_shuffle_ps::<0b01_00_01_00>(ab_low, cd_low));
                columns[4 * half + 1] = Self(_mm256_shuffle_ps::<0b11_10_11_10>(ab_low, cd_low));
                columns[4 * half + 2] = Self(_mm256_shuffle_ps::<0b01_00_01_00>(ab_high, cd_high));
                columns[4 * half + 3] = Self(_mm256_shuffle_ps::<0b11_10_11_10>(ab_high, cd_high));
            }
        }
        columns
    }
    #[inline(always)]
    fn look_up(table: &Table<f32>, picks: &[u32; 8], values: &mut [Self]) {
        table.look_up_singly(picks, values);
    }
}
