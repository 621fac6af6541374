//! Vectors agree with arrays, and lanes with numbers.

use super::*;
use std::fmt::Debug;

/// Numbers of both signs and many sizes.
fn numbers<const N: usize>(shift: usize) -> [f64; N] {
    std::array::from_fn(|i| ((i * 7 + shift * 3) as f64 * 1.3).sin() * 10f64.powi((i + shift) as i32 % 5))
}

#[inline(always)]
fn vector_operations<V: Vector<N>, const N: usize>(shift: usize) -> Vec<[V::Real; N]> {
    let row = |shift: usize| numbers::<N>(shift).map(V::Real::from_f64);
    let [a, b, c] = [shift, shift + 1, shift + 2].map(|shift| V::load(&row(shift)));
    let whole = V::load(&std::array::from_fn(|i| V::Real::from_f64((i + shift) as f64 - 20.0)));
    let nan = V::splat(V::Real::from_f64(f64::NAN));
    let table: [V::Real; LOOK_UP] = numbers(shift).map(V::Real::from_f64);
    let picks = std::array::from_fn(|i| (i * 2_654_435_761 + shift * 977) as u32);
    let rows: [[V::Real; 8]; N] = std::array::from_fn(|l| numbers(shift + l).map(V::Real::from_f64));
    let results = [
        a + b,
        a - b,
        a * b,
        a / b,
        a.max(b),
        a.min(b),
        nan.max(a),
        nan.min(a),
        a.mul_add(b, c),
        a.mul_sub(b, c),
        (whole + V::splat(V::Real::ROUNDER)).power_of_two(),
        (a * a).square_root(),
        a.exponential(),
        V::splat(row(shift)[1]),
        V::look_up(&table, &picks),
    ];
    results.into_iter().chain(V::transpose(&rows)).map(V::to_array).collect()
}

#[inline(always)]
fn eight_operations<V: EightLanes>(shift: usize) -> (Vec<[f64; 8]>, Vec<u8>, f64) {
    let [a, b] = [shift, shift + 1].map(|shift| V::load(&numbers(shift)));
    let nan = V::splat(f64::NAN);
    let eight = std::array::from_fn(|i| V::load(&numbers(shift + i)));
    let vectors = [
        a.truncate(),
        a.or((shift * 37) as u8, b),
        V::sums(&eight),
        a.select_below(b, eight[2], eight[3]),
        nan.select_below(b, a, b),
    ]
    .map(V::to_array);
    assert_eq!(vectors[2], eight.map(V::sum));
    let bits =
        [a.at_most(b), a.at_most(a), a.below(b), a.below(a), nan.at_most(a), nan.below(a), a.below(nan)];
    (vectors.to_vec(), bits.to_vec(), a.sum())
}

struct Operations;

impl Kernel for Operations {
    type Output = (Vec<Vec<[f64; 8]>>, Vec<Vec<[f32; 16]>>, Vec<(Vec<[f64; 8]>, Vec<u8>, f64)>);
    const FUSED: bool = true;

    #[inline(always)]
    fn run<S: Simd>(self) -> Self::Output {
        (
            (0..40).map(vector_operations::<S::F64, 8>).collect(),
            (0..40).map(vector_operations::<S::F32, 16>).collect(),
            (0..40).map(eight_operations::<S::F64>).collect(),
        )
    }
}

#[test]
fn every_instruction_set_computes_as_arrays_do() {
    let arrays = InstructionSet::PORTABLE.run(Operations);
    for set in InstructionSet::available() {
        assert_eq!(set.run(Operations), arrays, "{set}");
    }
}

#[test]
fn the_best_set_is_the_first_available() {
    assert_eq!(InstructionSet::available()[0], InstructionSet::best());
}

#[expect(clippy::needless_pass_by_value, reason = "arrays as the vectors give them")]
fn assert_lanes<T: PartialEq + Debug, const N: usize>(lanes: [T; N], lane: impl Fn(usize) -> T) {
    assert_eq!(lanes, std::array::from_fn(lane));
}

#[test]
fn a_lane_computes_as_a_number_does() {
    for shift in 0..40 {
        let (a, b, c) = (numbers(shift), numbers(shift + 1), numbers(shift + 2));
        let [x, y, z] = [a, b, c].map(|numbers| Array::<f64, 8, false>::load(&numbers));
        assert_lanes((x + y).to_array(), |l| a[l] + b[l]);
        assert_lanes((x - y).to_array(), |l| a[l] - b[l]);
        assert_lanes((x * y).to_array(), |l| a[l] * b[l]);
        assert_lanes((x / y).to_array(), |l| a[l] / b[l]);
        assert_lanes(x.max(y).to_array(), |l| Arithmetic::max(a[l], b[l]));
        assert_lanes(x.min(y).to_array(), |l| Arithmetic::min(a[l], b[l]));
        assert_lanes(x.truncate().to_array(), |l| a[l].truncate());
        assert_lanes(x.or(shift as u8, y).to_array(), |l| a[l].or(shift as u8 >> l, b[l]));
        assert_lanes(x.mul_add(y, z).to_array(), |l| a[l] * b[l] + c[l]);
        let [x, y, z] = [a, b, c].map(|numbers| Array::<f64, 8, true>::load(&numbers));
        assert_lanes(x.mul_add(y, z).to_array(), |l| a[l].mul_add(b[l], c[l]));
        assert_lanes(x.mul_sub(y, z).to_array(), |l| a[l].mul_add(b[l], -c[l]));
        for lane in 0..8 {
            assert_eq!(x.at_most(y) >> lane & 1, a[lane].at_most(b[lane]));
            assert_eq!(x.below(y) >> lane & 1 == 1, a[lane] < b[lane]);
        }
        assert_lanes(x.select_below(y, z, x).to_array(), |l| if a[l] < b[l] { c[l] } else { a[l] });
        let nan = Array::<f64, 8, true>::splat(f64::NAN);
        assert_eq!((nan.max(x).to_array(), nan.min(x).to_array()), (a, a));
    }
}

#[test]
fn a_whole_number_is_the_exponent_of_two() {
    for n in -100..=100 {
        let shifted = Array::<f64, 1, true>::splat(f64::from(n) + f64::ROUNDER);
        assert_eq!(shifted.power_of_two().to_array(), [2f64.powi(n)]);
        let shifted = Array::<f32, 1, true>::splat(n as f32 + f32::ROUNDER);
        assert_eq!(shifted.power_of_two().to_array(), [2f32.powi(n)]);
    }
}

#[test]
fn the_exponential_is_right_to_fourteen_digits() {
    let exponential = |z: f64| Array::<f64, 1, true>::splat(z).exponential().to_array()[0];
    for z in (-6990..=6990).map(|i| 0.1 * f64::from(i)) {
        assert!((exponential(z) / z.exp() - 1.0).abs() < 2e-13, "{z}");
    }
    assert_eq!(exponential(0.0), 1.000_000_000_000_012_7);
    assert!(exponential(-1e300) < 1e-300 && exponential(1e300).is_finite());
}
