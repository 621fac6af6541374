//! What a plain number and eight numbers side by side have in common.

use super::Eight;
use std::ops::{Add, Div, Mul, Sub};

/// A number, or several side by side. Every operation is lane by lane and rounds as IEEE 754 says, so that what is
/// written against this gives the same bits for one reading and for eight.
pub(in crate::influence) trait Number:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self>
{
    fn splat(value: f64) -> Self;
    /// The larger; `other` where they cannot be compared.
    fn max(self, other: Self) -> Self;
    /// The smaller; `other` where they cannot be compared.
    fn min(self, other: Self) -> Self;
    /// Without what is after the point.
    fn truncate(self) -> Self;
    /// Bit i is set where lane i is at most `other`'s.
    fn at_most(self, other: Self) -> u8;
    /// `self` where the lane's bit is set, `other` where it is not.
    fn or(self, bits: u8, other: Self) -> Self;
}

/// One number each of readings that are worked on side by side, one or eight, with their channels in `V`.
pub(in crate::influence) trait Abreast<V: Copy>: Number {
    /// How many readings.
    const COUNT: usize;
    /// The bits of all of them.
    const ALL: u8 = (u8::MAX as u32 >> (8 - Self::COUNT)) as u8;
    /// Something of each reading.
    type Each<T: Copy>: AsRef<[T]> + AsMut<[T]>;

    fn each<T: Copy>(value: T) -> Self::Each<T>;
    fn lanes(self) -> Self::Each<f64>;
    fn of(lanes: &Self::Each<f64>) -> Self;
    /// The sums over channels of each reading's K vectors.
    fn sums<const K: usize>(vectors: &Self::Each<[V; K]>) -> [Self; K];
}

impl Number for f64 {
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

impl<V: Eight> Abreast<V> for f64 {
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
    fn of(lanes: &[f64; 1]) -> f64 {
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

impl<V: Eight> Abreast<V> for V {
    const COUNT: usize = 8;
    type Each<T: Copy> = [T; 8];

    #[inline(always)]
    fn each<T: Copy>(value: T) -> [T; 8] {
        [value; 8]
    }
    #[inline(always)]
    fn lanes(self) -> [f64; 8] {
        let mut lanes = [0.0; 8];
        self.store(&mut lanes);
        lanes
    }
    #[inline(always)]
    fn of(lanes: &[f64; 8]) -> Self {
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
