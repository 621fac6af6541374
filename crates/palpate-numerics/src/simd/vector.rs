//! Operations by lane, rounded by IEEE 754.

use std::ops::{Add, Div, Mul, Neg, Sub};

/// A lane: f64 or f32.
pub trait Real:
    Copy
    + PartialOrd
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
    + 'static
{
    /// 1.5·2^mantissa + bias: added, it rounds to n, with the exponent of 2ⁿ in the low bits.
    const ROUNDER: Self;
    /// Minimax polynomial of 2^r, |r| ≤ ½ (Remez), ascending.
    const EXP2: &'static [Self];
    /// Half of the largest argument of an exponential.
    const HALF_OF_EXP: Self;
    /// Rounds to this type.
    fn from_f64(x: f64) -> Self;
    /// Converts exactly.
    fn to_f64(self) -> f64;
    /// `self` · `factor` + `term`, rounded once.
    fn fused_mul_add(self, factor: Self, term: Self) -> Self;
    /// Square root.
    fn square_root(self) -> Self;
    /// 2ⁿ of `self` = n + [`Real::ROUNDER`], if normal.
    fn power_of_two(self) -> Self;
}

macro_rules! real {
    ($real:ident, ROUNDER: $rounder:literal, HALF_OF_EXP: $half:literal, EXP2: [$($coefficient:literal),*]) => {
        impl Real for $real {
            const ROUNDER: Self = $rounder;
            const EXP2: &'static [Self] = &[$($coefficient),*];
            const HALF_OF_EXP: Self = $half;
            #[inline(always)]
            fn from_f64(x: f64) -> Self {
                x as $real
            }
            #[inline(always)]
            fn to_f64(self) -> f64 {
                f64::from(self)
            }
            #[inline(always)]
            fn fused_mul_add(self, factor: Self, term: Self) -> Self {
                self.mul_add(factor, term)
            }
            #[inline(always)]
            fn square_root(self) -> Self {
                self.sqrt()
            }
            #[inline(always)]
            fn power_of_two(self) -> Self {
                $real::from_bits(self.to_bits() << ($real::MANTISSA_DIGITS - 1))
            }
        }
    };
}

// Relative error 1.4e-14.
real!(f64, ROUNDER: 6_755_399_441_056_767.0, HALF_OF_EXP: 350.0, EXP2: [
    1.000_000_000_000_012_7,
    0.693_147_180_559_871,
    0.240_226_506_956_496_53,
    0.055_504_108_668_685_623,
    0.009_618_129_192_067_193,
    0.001_333_355_761_760_242_4,
    0.000_154_034_349_481_035_28,
    0.000_015_252_984_839_814_557,
    1.325_940_560_357_369_6e-6,
    1.015_033_649_514_861_8e-7
]);

// Relative error 7.5e-8.
real!(f32, ROUNDER: 12_583_039.0, HALF_OF_EXP: 43.0, EXP2: [
    1.000_000_1,
    0.693_146_94,
    0.240_221_2,
    0.055_507_13,
    0.009_675_541,
    0.001_327_647_2
]);

/// A number, or several.
pub trait Arithmetic:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self>
{
    /// Type of a lane.
    type Real: Real;
    /// Returns `value` in every lane.
    fn splat(value: Self::Real) -> Self;
    /// Maximum; `other` if unordered.
    fn max(self, other: Self) -> Self;
    /// Minimum; `other` if unordered.
    fn min(self, other: Self) -> Self;
}

/// One f64 or eight, with results of equal bits.
pub trait Number: Arithmetic<Real = f64> {
    /// Integer part.
    fn truncate(self) -> Self;
    /// Bit i: lane i is at most that of `other`.
    fn at_most(self, other: Self) -> u8;
    /// `self` for set bits, otherwise `other`.
    fn or(self, bits: u8, other: Self) -> Self;
}

/// Length of a look-up table: two AVX-512 registers of f32.
pub const LOOK_UP: usize = 32;

/// N numbers.
pub trait Vector<const N: usize>: Arithmetic {
    /// Loads the lanes.
    fn load(values: &[Self::Real; N]) -> Self;
    /// Stores the lanes.
    fn to_array(self) -> [Self::Real; N];
    /// `self` · `factor` + `term`, fused where possible.
    fn mul_add(self, factor: Self, term: Self) -> Self;
    /// `self` · `factor` − `term`, fused where possible.
    fn mul_sub(self, factor: Self, term: Self) -> Self;
    /// Square root.
    fn square_root(self) -> Self;
    /// 2ⁿ of `self` = n + [`Real::ROUNDER`], if normal.
    fn power_of_two(self) -> Self;

    /// eᶻ = 2^n · 2^r; z is clamped to ± twice [`Real::HALF_OF_EXP`].
    #[inline(always)]
    fn exponential(self) -> Self {
        let number = |x: f64| Self::splat(Self::Real::from_f64(x));
        let end = Self::splat(Self::Real::HALF_OF_EXP + Self::Real::HALF_OF_EXP);
        let z = self.min(end).max(number(0.0) - end);
        let to_binary = number(std::f64::consts::LOG2_E);
        let rounder = Self::splat(Self::Real::ROUNDER);
        let shifted = z.mul_add(to_binary, rounder);
        let r = z.mul_sub(to_binary, shifted - rounder);
        let mut power = Self::splat(Self::Real::EXP2[Self::Real::EXP2.len() - 1]);
        for i in (0..Self::Real::EXP2.len() - 1).rev() {
            power = power.mul_add(r, Self::splat(Self::Real::EXP2[i]));
        }
        power * shifted.power_of_two()
    }

    /// Looks up indices, by low bits.
    #[inline(always)]
    fn look_up(numbers: &[Self::Real; LOOK_UP], picks: &[u32; N]) -> Self {
        let mut lanes = [numbers[0]; N];
        for l in 0..N {
            lanes[l] = numbers[picks[l] as usize % LOOK_UP];
        }
        Self::load(&lanes)
    }

    /// Columns of N rows.
    #[inline(always)]
    fn transpose(rows: &[[Self::Real; 8]; N]) -> [Self; 8] {
        let mut columns = [Self::splat(rows[0][0]); 8];
        for (k, column) in columns.iter_mut().enumerate() {
            let mut lanes = [rows[0][0]; N];
            for l in 0..N {
                lanes[l] = rows[l][k];
            }
            *column = Self::load(&lanes);
        }
        columns
    }
}

/// Eight f64.
pub trait EightLanes: Number + Vector<8> {
    /// Bit i: lane i is below that of `other`.
    fn below(self, other: Self) -> u8;

    /// `value` where `self` is below `bound`, otherwise `other`.
    #[inline(always)]
    fn select_below(self, bound: Self, value: Self, other: Self) -> Self {
        value.or(self.below(bound), other)
    }

    /// Sum in a fixed order.
    #[inline(always)]
    fn sum(self) -> f64 {
        let a = self.to_array();
        ((a[0] + a[4]) + (a[2] + a[6])) + ((a[1] + a[5]) + (a[3] + a[7]))
    }

    /// [`EightLanes::sum`] of each of eight vectors.
    #[inline(always)]
    fn sums(eight: &[Self; 8]) -> Self {
        let mut sums = [0.0; 8];
        for l in 0..8 {
            sums[l] = eight[l].sum();
        }
        Self::load(&sums)
    }
}

impl Arithmetic for f64 {
    type Real = f64;
    #[inline(always)]
    fn splat(value: f64) -> Self {
        value
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        if self > other { self } else { other }
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        if self < other { self } else { other }
    }
}

impl Number for f64 {
    #[inline(always)]
    fn truncate(self) -> Self {
        self.trunc()
    }
    #[inline(always)]
    fn at_most(self, other: Self) -> u8 {
        u8::from(self <= other)
    }
    #[inline(always)]
    fn or(self, bits: u8, other: Self) -> Self {
        if bits & 1 == 1 { self } else { other }
    }
}

/// One number per row, for one row or eight with equal bits; `V` is a row's vector.
pub trait RowLanes<V: Copy>: Number {
    /// Number of rows.
    const COUNT: usize;
    /// Bits of all rows.
    const ALL: u8 = (u8::MAX as u32 >> (8 - Self::COUNT)) as u8;
    /// One value per row.
    type Each<T: Copy>: AsRef<[T]> + AsMut<[T]>;

    /// Returns `value` for each row.
    fn each<T: Copy>(value: T) -> Self::Each<T>;
    /// Returns the numbers.
    fn lanes(self) -> Self::Each<f64>;
    /// Creates lanes from numbers.
    fn from_lanes(lanes: &Self::Each<f64>) -> Self;
    /// [`EightLanes::sum`] of each row's K vectors.
    fn sums<const K: usize>(vectors: &Self::Each<[V; K]>) -> [Self; K];
}

impl<V: EightLanes> RowLanes<V> for f64 {
    const COUNT: usize = 1;
    type Each<T: Copy> = [T; 1];

    #[inline(always)]
    fn each<T: Copy>(value: T) -> [T; 1] {
        [value]
    }
    #[inline(always)]
    fn lanes(self) -> [f64; 1] {
        [self]
    }
    #[inline(always)]
    fn from_lanes(lanes: &[f64; 1]) -> f64 {
        lanes[0]
    }
    #[inline(always)]
    fn sums<const K: usize>(vectors: &[[V; K]; 1]) -> [f64; K] {
        let mut sums = [0.0; K];
        for k in 0..K {
            sums[k] = vectors[0][k].sum();
        }
        sums
    }
}

impl<V: EightLanes> RowLanes<V> for V {
    const COUNT: usize = 8;
    type Each<T: Copy> = [T; 8];

    #[inline(always)]
    fn each<T: Copy>(value: T) -> [T; 8] {
        [value; 8]
    }
    #[inline(always)]
    fn lanes(self) -> [f64; 8] {
        self.to_array()
    }
    #[inline(always)]
    fn from_lanes(lanes: &[f64; 8]) -> Self {
        V::load(lanes)
    }
    #[inline(always)]
    fn sums<const K: usize>(vectors: &[[V; K]; 8]) -> [V; K] {
        let [a, b, c, d, e, f, g, h] = vectors;
        let mut sums = [V::splat(0.0); K];
        for k in 0..K {
            sums[k] = V::sums(&[a[k], b[k], c[k], d[k], e[k], f[k], g[k], h[k]]);
        }
        sums
    }
}
