//! Vectors made of the instructions of AVX-512 and AVX2.
//!
//! Safety of every block that calls instructions: [`super::InstructionSet`] passes these types to a kernel only after it has detected
//! the instructions on the machine, and no other code can name them.
#![allow(unsafe_code, reason = "instructions that the machine was asked for")]
#![allow(
    clippy::missing_transmute_annotations,
    reason = "the registers of a macro have the types of its callers"
)]

use super::{Arithmetic, EightLanes, LOOK_UP, Number, Vector};
use std::arch::x86_64::*;
use std::mem::transmute;
use std::ops::{Add, Div, Mul, Sub};

/// Vector from `$value` for each register `$r`.
macro_rules! each_register {
    ($any:expr, $r:ident => $value:expr) => {{
        let mut registers = $any.0;
        for $r in 0..registers.len() {
            // SAFETY: see the head of this file.
            registers[$r] = unsafe { $value };
        }
        Self(registers)
    }};
}

macro_rules! operator {
    ($vector:ident $operator:ident $name:ident $instruction:ident) => {
        impl $operator for $vector {
            type Output = Self;
            #[inline(always)]
            fn $name(self, other: Self) -> Self {
                each_register!(self, r => $instruction(self.0[r], other.0[r]))
            }
        }
    };
}

macro_rules! vector {
    (
        $(#[$doc:meta])* $vector:ident: [$real:ty; $lanes:literal] in [$register:ty; $registers:literal],
        $splat:ident, $add:ident, $sub:ident, $mul:ident, $div:ident, $max:ident, $min:ident, $mul_add:ident, $mul_sub:ident,
        $square_root:ident,
        power_of_two: $n:ident => $power_of_two:expr,
        $($look_up_and_transpose:item)*
    ) => {
        $(#[$doc])*
        #[derive(Clone, Copy)]
        pub struct $vector([$register; $registers]);

        operator!($vector Add add $add);
        operator!($vector Sub sub $sub);
        operator!($vector Mul mul $mul);
        operator!($vector Div div $div);

        impl Arithmetic for $vector {
            type Real = $real;
            #[inline(always)]
            fn splat(value: $real) -> Self {
                // SAFETY: see the head of this file.
                Self([unsafe { $splat(value) }; $registers])
            }
            #[inline(always)]
            fn max(self, other: Self) -> Self {
                each_register!(self, r => $max(self.0[r], other.0[r]))
            }
            #[inline(always)]
            fn min(self, other: Self) -> Self {
                each_register!(self, r => $min(self.0[r], other.0[r]))
            }
        }

        impl Vector<$lanes> for $vector {
            #[inline(always)]
            fn load(values: &[$real; $lanes]) -> Self {
                // SAFETY: both are 64 bytes of numbers, and any bits are a number. A copy of the array would be stored in halves before it
                // is loaded as a whole, which stalls the machine.
                Self(unsafe { values.as_ptr().cast::<[$register; $registers]>().read_unaligned() })
            }
            #[inline(always)]
            fn to_array(self) -> [$real; $lanes] {
                let mut lanes = [0.0; $lanes];
                // SAFETY: both are 64 bytes of numbers, and any bits are a number.
                unsafe { lanes.as_mut_ptr().cast::<[$register; $registers]>().write_unaligned(self.0) };
                lanes
            }
            #[inline(always)]
            fn mul_add(self, factor: Self, term: Self) -> Self {
                each_register!(self, r => $mul_add(self.0[r], factor.0[r], term.0[r]))
            }
            #[inline(always)]
            fn mul_sub(self, factor: Self, term: Self) -> Self {
                each_register!(self, r => $mul_sub(self.0[r], factor.0[r], term.0[r]))
            }
            #[inline(always)]
            fn square_root(self) -> Self {
                each_register!(self, r => $square_root(self.0[r]))
            }
            #[inline(always)]
            fn power_of_two(self) -> Self {
                each_register!(self, r => { let $n = self.0[r]; $power_of_two })
            }
            $($look_up_and_transpose)*
        }
    };
}

/// Transposes squares of 4 × 4 numbers.
macro_rules! transpose {
    ($quarters:literal quarters: $low:ident, $high:ident, $shuffle:ident) => {
        #[inline(always)]
        fn transpose(rows: &[[f32; 8]; 16]) -> [Self; 8] {
            let mut columns = [Self::splat(0.0); 8];
            // SAFETY: see the head of this file; the transmuted types contain the same number of values, and any bits are a number.
            unsafe {
                let rows = transmute::<[[f32; 8]; 16], [[__m128; 2]; 16]>(*rows);
                for (r, rows) in rows.as_chunks::<{ 4 * $quarters }>().0.iter().enumerate() {
                    for half in 0..2 {
                        let mut squares = [[rows[0][half]; $quarters]; 4];
                        for (i, row) in rows.iter().enumerate() {
                            squares[i % 4][i / 4] = row[half];
                        }
                        let [a, b, c, d] = squares;
                        let (a, b, c, d) = (transmute(a), transmute(b), transmute(c), transmute(d));
                        let (ab_low, ab_high, cd_low, cd_high) =
                            ($low(a, b), $high(a, b), $low(c, d), $high(c, d));
                        columns[4 * half].0[r] = $shuffle::<0b01_00_01_00>(ab_low, cd_low);
                        columns[4 * half + 1].0[r] = $shuffle::<0b11_10_11_10>(ab_low, cd_low);
                        columns[4 * half + 2].0[r] = $shuffle::<0b01_00_01_00>(ab_high, cd_high);
                        columns[4 * half + 3].0[r] = $shuffle::<0b11_10_11_10>(ab_high, cd_high);
                    }
                }
            }
            columns
        }
    };
}

vector! {
    /// Eight f64 in a register.
    Avx512F64: [f64; 8] in [__m512d; 1],
    _mm512_set1_pd, _mm512_add_pd, _mm512_sub_pd, _mm512_mul_pd, _mm512_div_pd, _mm512_max_pd, _mm512_min_pd,
    _mm512_fmadd_pd, _mm512_fmsub_pd, _mm512_sqrt_pd,
    power_of_two: n => _mm512_castsi512_pd(_mm512_slli_epi64::<52>(_mm512_castpd_si512(n))),

    /// Faster than a gather.
    #[inline(always)]
    fn look_up(numbers: &[f64; LOOK_UP], picks: &[u32; 8]) -> Self {
        // SAFETY: see the head of this file; all of these are arrays of numbers of the same size, and any bits are a number.
        unsafe {
            let [n0, n1, n2, n3] = transmute::<[f64; LOOK_UP], [__m512d; 4]>(*numbers);
            let picks = _mm512_cvtepu32_epi64(transmute::<[u32; 8], __m256i>(*picks));
            let upper_half = _mm512_test_epi64_mask(picks, _mm512_set1_epi64(16));
            let (low, high) = (_mm512_permutex2var_pd(n0, picks, n1), _mm512_permutex2var_pd(n2, picks, n3));
            Self([_mm512_mask_blend_pd(upper_half, low, high)])
        }
    }
}

vector! {
    /// Sixteen f32 in a register.
    Avx512F32: [f32; 16] in [__m512; 1],
    _mm512_set1_ps, _mm512_add_ps, _mm512_sub_ps, _mm512_mul_ps, _mm512_div_ps, _mm512_max_ps, _mm512_min_ps,
    _mm512_fmadd_ps, _mm512_fmsub_ps, _mm512_sqrt_ps,
    power_of_two: n => _mm512_castsi512_ps(_mm512_slli_epi32::<23>(_mm512_castps_si512(n))),

    /// Faster than a gather.
    #[inline(always)]
    fn look_up(numbers: &[f32; LOOK_UP], picks: &[u32; 16]) -> Self {
        // SAFETY: see the head of this file; all of these are arrays of numbers of the same size, and any bits are a number.
        unsafe {
            let [low, high] = transmute::<[f32; LOOK_UP], [__m512; 2]>(*numbers);
            Self([_mm512_permutex2var_ps(low, transmute::<[u32; 16], __m512i>(*picks), high)])
        }
    }

    transpose!(4 quarters: _mm512_unpacklo_ps, _mm512_unpackhi_ps, _mm512_shuffle_ps);
}

vector! {
    /// Eight f64 in two registers.
    Avx2F64: [f64; 8] in [__m256d; 2],
    _mm256_set1_pd, _mm256_add_pd, _mm256_sub_pd, _mm256_mul_pd, _mm256_div_pd, _mm256_max_pd, _mm256_min_pd,
    _mm256_fmadd_pd, _mm256_fmsub_pd, _mm256_sqrt_pd,
    power_of_two: n => _mm256_castsi256_pd(_mm256_slli_epi64::<52>(_mm256_castpd_si256(n))),
}

vector! {
    /// Sixteen f32 in two registers.
    Avx2F32: [f32; 16] in [__m256; 2],
    _mm256_set1_ps, _mm256_add_ps, _mm256_sub_ps, _mm256_mul_ps, _mm256_div_ps, _mm256_max_ps, _mm256_min_ps,
    _mm256_fmadd_ps, _mm256_fmsub_ps, _mm256_sqrt_ps,
    power_of_two: n => _mm256_castsi256_ps(_mm256_slli_epi32::<23>(_mm256_castps_si256(n))),

    transpose!(2 quarters: _mm256_unpacklo_ps, _mm256_unpackhi_ps, _mm256_shuffle_ps);
}

impl Number for Avx512F64 {
    #[inline(always)]
    fn truncate(self) -> Self {
        each_register!(self, r => _mm512_roundscale_pd::<{ _MM_FROUND_TO_ZERO | _MM_FROUND_NO_EXC }>(self.0[r]))
    }
    #[inline(always)]
    fn at_most(self, other: Self) -> u8 {
        // SAFETY: see the head of this file.
        unsafe { _mm512_cmp_pd_mask::<_CMP_LE_OQ>(self.0[0], other.0[0]) }
    }
    #[inline(always)]
    fn or(self, bits: u8, other: Self) -> Self {
        each_register!(self, r => _mm512_mask_blend_pd(bits, other.0[r], self.0[r]))
    }
}

impl EightLanes for Avx512F64 {
    #[inline(always)]
    fn below(self, other: Self) -> u8 {
        // SAFETY: see the head of this file.
        unsafe { _mm512_cmp_pd_mask::<_CMP_LT_OQ>(self.0[0], other.0[0]) }
    }
    #[inline(always)]
    fn sum(self) -> f64 {
        // SAFETY: see the head of this file.
        unsafe {
            let [whole] = self.0;
            sum_of_four(_mm256_add_pd(_mm512_castpd512_pd256(whole), _mm512_extractf64x4_pd::<1>(whole)))
        }
    }
    #[inline(always)]
    fn sums(eight: &[Self; 8]) -> Self {
        let [Self([a]), Self([b]), Self([c]), Self([d]), Self([e]), Self([f]), Self([g]), Self([h])] = *eight;
        // SAFETY: see the head of this file.
        unsafe {
            // (0 + 4, 1 + 5, 2 + 6, 3 + 7), of a and of b.
            let halves = |a: __m512d, b: __m512d| {
                _mm512_add_pd(_mm512_shuffle_f64x2::<0x44>(a, b), _mm512_shuffle_f64x2::<0xee>(a, b))
            };
            // ((0 + 4) + (2 + 6), (1 + 5) + (3 + 7)), of four.
            let quarters = |ab: __m512d, cd: __m512d| {
                _mm512_add_pd(_mm512_shuffle_f64x2::<0x88>(ab, cd), _mm512_shuffle_f64x2::<0xdd>(ab, cd))
            };
            let even = quarters(halves(a, c), halves(e, g));
            let odd = quarters(halves(b, d), halves(f, h));
            Self([_mm512_add_pd(_mm512_unpacklo_pd(even, odd), _mm512_unpackhi_pd(even, odd))])
        }
    }
}

/// (0 + 2) + (1 + 3), by lane.
///
/// # Safety
/// See the head of this file.
#[inline(always)]
unsafe fn sum_of_four(four: __m256d) -> f64 {
    // SAFETY: as the function's own.
    unsafe {
        let two = _mm_add_pd(_mm256_castpd256_pd128(four), _mm256_extractf128_pd::<1>(four));
        _mm_cvtsd_f64(_mm_add_sd(two, _mm_unpackhi_pd(two, two)))
    }
}

impl Avx2F64 {
    #[inline(always)]
    fn signs(self) -> u8 {
        let [low, high] = self.0;
        // SAFETY: see the head of this file.
        unsafe { (_mm256_movemask_pd(low) | _mm256_movemask_pd(high) << 4) as u8 }
    }
}

impl Number for Avx2F64 {
    #[inline(always)]
    fn truncate(self) -> Self {
        each_register!(self, r => _mm256_round_pd::<{ _MM_FROUND_TO_ZERO | _MM_FROUND_NO_EXC }>(self.0[r]))
    }
    #[inline(always)]
    fn at_most(self, other: Self) -> u8 {
        each_register!(self, r => _mm256_cmp_pd::<_CMP_LE_OQ>(self.0[r], other.0[r])).signs()
    }
    #[inline(always)]
    fn or(self, bits: u8, other: Self) -> Self {
        each_register!(self, r => {
            let bit = 1 << (4 * r);
            let lanes = _mm256_setr_epi64x(bit, 2 * bit, 4 * bit, 8 * bit);
            let set = _mm256_and_si256(_mm256_set1_epi64x(i64::from(bits)), lanes);
            _mm256_blendv_pd(other.0[r], self.0[r], _mm256_castsi256_pd(_mm256_cmpeq_epi64(set, lanes)))
        })
    }
}

impl EightLanes for Avx2F64 {
    #[inline(always)]
    fn below(self, other: Self) -> u8 {
        each_register!(self, r => _mm256_cmp_pd::<_CMP_LT_OQ>(self.0[r], other.0[r])).signs()
    }
    // Without the conversion to bits and back, which would take as long as eight additions.
    #[inline(always)]
    fn select_below(self, bound: Self, value: Self, other: Self) -> Self {
        each_register!(self, r => {
            _mm256_blendv_pd(other.0[r], value.0[r], _mm256_cmp_pd::<_CMP_LT_OQ>(self.0[r], bound.0[r]))
        })
    }
    #[inline(always)]
    fn sum(self) -> f64 {
        let [low, high] = self.0;
        // SAFETY: see the head of this file.
        unsafe { sum_of_four(_mm256_add_pd(low, high)) }
    }
    #[inline(always)]
    fn sums(eight: &[Self; 8]) -> Self {
        let [a, b, c, d, e, f, g, h] = *eight;
        // SAFETY: see the head of this file.
        unsafe {
            // ((0 + 4) + (2 + 6), (1 + 5) + (3 + 7)), of a and of b.
            let quarters = |Self([a_low, a_high]): Self, Self([b_low, b_high]): Self| {
                let (a, b) = (_mm256_add_pd(a_low, a_high), _mm256_add_pd(b_low, b_high));
                _mm256_add_pd(_mm256_permute2f128_pd::<0x20>(a, b), _mm256_permute2f128_pd::<0x31>(a, b))
            };
            let four = |even: __m256d, odd: __m256d| {
                _mm256_add_pd(_mm256_unpacklo_pd(even, odd), _mm256_unpackhi_pd(even, odd))
            };
            Self([four(quarters(a, c), quarters(b, d)), four(quarters(e, g), quarters(f, h))])
        }
    }
}
