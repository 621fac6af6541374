//! Many networks at once, one per SIMD lane.
//!
//! [`Lanes`] is the arithmetic that training needs, on N numbers at a time. One kernel ([`kernel`]) is written
//! against it; the instruction sets ([`avx512`], [`avx2`]) and plain arrays ([`portable`]) implement it, and
//! [`dispatch`] picks the widest that the machine has when the program runs. A multiply-add rounds once on every
//! machine that can fuse it, so all of these give the same networks to the last bit.

#[cfg(target_arch = "x86_64")]
mod avx2;
#[cfg(target_arch = "x86_64")]
mod avx512;
mod dispatch;
mod forward;
mod kernel;
mod logistic;
mod order;
mod portable;
mod single;

#[cfg(test)]
pub(super) use dispatch::forward_one_portable;
pub use dispatch::{InstructionSet, Precision};
pub(super) use dispatch::{forward_lanes, forward_one, train_lanes, train_scalar};
pub(super) use forward::Batch;
pub(super) use logistic::{activate, derivative};
pub(super) use order::{OrderDrawer, Streams};
pub(super) use single::Layer;

/// The number in one lane.
pub(crate) trait Real: Copy + PartialOrd + Send + Sync + 'static {
    /// Adding then subtracting it rounds to a whole number n; the sum's low bits are then the exponent of 2^n: 1.5·2^mantissa + bias.
    const ROUNDER: Self;
    /// Coefficients of the minimax polynomial of 2^r on |r| ≤ ½ (Remez, relative error), lowest first.
    const EXP2: &'static [Self];
    /// Beyond this |z| the logistic function is held, so that the product of two denominators stays finite.
    const LOGISTIC_END: Self;
    fn from_f64(x: f64) -> Self;
    fn to_f64(self) -> f64;
}

impl Real for f64 {
    const ROUNDER: Self = 6_755_399_441_056_767.0;
    // Relative error 1.4e-14.
    const EXP2: &'static [Self] = &[
        1.000_000_000_000_012_7,
        0.693_147_180_559_871,
        0.240_226_506_956_496_53,
        0.055_504_108_668_685_623,
        0.009_618_129_192_067_193,
        0.001_333_355_761_760_242_4,
        0.000_154_034_349_481_035_28,
        0.000_015_252_984_839_814_557,
        1.325_940_560_357_369_6e-6,
        1.015_033_649_514_861_8e-7,
    ];
    const LOGISTIC_END: Self = 350.0;
    #[inline(always)]
    fn from_f64(x: f64) -> Self {
        x
    }
    #[inline(always)]
    fn to_f64(self) -> f64 {
        self
    }
}

impl Real for f32 {
    const ROUNDER: Self = 12_583_039.0;
    // Relative error 7.5e-8.
    const EXP2: &'static [Self] =
        &[1.000_000_1, 0.693_146_94, 0.240_221_2, 0.055_507_13, 0.009_675_541, 0.001_327_647_2];
    const LOGISTIC_END: Self = 43.0;
    #[inline(always)]
    fn from_f64(x: f64) -> Self {
        x as f32
    }
    #[inline(always)]
    fn to_f64(self) -> f64 {
        f64::from(self)
    }
}

/// N numbers of one precision, side by side. Every operation is lane by lane and rounds as IEEE 754 says.
pub(crate) trait Lanes<const N: usize>: Copy {
    type Real: Real;
    fn from_array(values: [Self::Real; N]) -> Self;
    fn to_array(self) -> [Self::Real; N];
    fn splat(value: Self::Real) -> Self;
    fn add(self, other: Self) -> Self;
    fn sub(self, other: Self) -> Self;
    fn mul(self, other: Self) -> Self;
    fn div(self, other: Self) -> Self;
    fn min(self, other: Self) -> Self;
    fn max(self, other: Self) -> Self;
    /// `self · factor + term`
    fn mul_add(self, factor: Self, term: Self) -> Self;
    /// `self · factor − term`
    fn mul_sub(self, factor: Self, term: Self) -> Self;
    /// 2^n of `self` = n + [`Real::ROUNDER`], where that is a normal number.
    fn power_of_two(self) -> Self;
    /// Turns N rows of eight numbers into one register a column.
    #[inline(always)]
    fn transpose(rows: &[[Self::Real; 8]; N]) -> [Self; 8] {
        let mut columns = [Self::splat(rows[0][0]); 8];
        for (k, column) in columns.iter_mut().enumerate() {
            let mut lanes = [rows[0][0]; N];
            for l in 0..N {
                lanes[l] = rows[l][k];
            }
            *column = Self::from_array(lanes);
        }
        columns
    }
    /// For every column of the table, the value of each lane's pick, of which only the low bits count.
    fn look_up(table: &Table<Self::Real>, picks: &[u32; N], values: &mut [Self]);
}

/// Columns of numbers, one number a pattern.
pub(crate) struct Table<R> {
    /// Length of a column: a power of two, so that no pick, masked to it, lies outside.
    column_len: usize,
    values: Vec<R>,
}

impl<R: Real> Table<R> {
    /// Turns rows of `width` values into columns.
    pub(crate) fn from_rows(rows: &[f64], width: usize) -> Self {
        let column_len = column_len(rows.len() / width.max(1));
        let mut values = vec![R::from_f64(0.0); column_len * width];
        for (k, &value) in rows.iter().enumerate() {
            values[k % width * column_len + k / width] = R::from_f64(value);
        }
        Self { column_len, values }
    }

    /// One value after the other, for machines and tables that know no better.
    #[inline(always)]
    fn look_up_singly<V: Lanes<N, Real = R>, const N: usize>(&self, picks: &[u32; N], values: &mut [V]) {
        for (column, value) in self.values.chunks_exact(self.column_len).zip(values) {
            let mut lanes = [column[0]; N];
            for l in 0..N {
                lanes[l] = column[picks[l] as usize & (column.len() - 1)];
            }
            *value = V::from_array(lanes);
        }
    }

    /// The columns as arrays, where they have the shortest length.
    #[inline(always)]
    fn short_columns(&self) -> Option<&[[R; SHORTEST_COLUMN]]> {
        (self.column_len == SHORTEST_COLUMN).then(|| self.values.as_chunks().0)
    }
}

/// The length of a column that holds `patterns` numbers.
fn column_len(patterns: usize) -> usize {
    patterns.next_power_of_two().max(SHORTEST_COLUMN)
}

/// Columns are padded to at least this, two AVX-512 registers of f32.
const SHORTEST_COLUMN: usize = 32;
