//! Vectorized activation functions.

use super::Activation;
use palpate_numerics::simd::{Real, Vector};
use std::f64::consts::LOG2_E;

/// Multiply-adds for two units, and the paper's ten hidden nodes.
const BLOCK: usize = 10;

/// 1 + exp(−z) by 2^n · 2^r with a polynomial in r.
#[inline(always)]
fn denominators<V: Vector<N>, const N: usize, const B: usize>(z: [V; B]) -> [V; B] {
    let number = |x: f64| V::splat(V::Real::from_f64(x));
    let (end, to_binary) = (V::splat(V::Real::HALF_OF_EXP), number(-LOG2_E));
    let (lowest, rounder) = (number(0.0) - end, V::splat(V::Real::ROUNDER));
    let (mut shifted, mut r) = (z, z);
    for i in 0..B {
        let z = z[i].min(end).max(lowest);
        shifted[i] = z.mul_add(to_binary, rounder);
        r[i] = z.mul_sub(to_binary, shifted[i] - rounder);
    }
    let mut power = [V::splat(V::Real::EXP2[V::Real::EXP2.len() - 1]); B];
    for &coefficient in V::Real::EXP2.iter().rev().skip(1) {
        for i in 0..B {
            power[i] = power[i].mul_add(r[i], V::splat(coefficient));
        }
    }
    for i in 0..B {
        power[i] = power[i].mul_add(shifted[i].power_of_two(), number(1.0));
    }
    power
}

/// 1 / (1 + exp(−z)), two values per division: 1/a = b/(a·b).
#[inline(always)]
fn logistic_block<V: Vector<N>, const N: usize, const B: usize>(values: &mut [V; B]) {
    let one = V::splat(V::Real::from_f64(1.0));
    let denominators = denominators(*values);
    for i in (0..B - B % 2).step_by(2) {
        let [a, b] = [denominators[i], denominators[i + 1]];
        let inverse = one / (a * b);
        [values[i], values[i + 1]] = [b * inverse, a * inverse];
    }
    if B % 2 == 1 {
        values[B - 1] = one / denominators[B - 1];
    }
}

#[inline(always)]
pub(crate) fn activate<V: Vector<N>, const N: usize>(activation: Activation, values: &mut [V]) {
    let (blocks, rest) = values.as_chunks_mut::<BLOCK>();
    for block in blocks {
        activate_block(activation, block);
    }
    let (pairs, rest) = rest.as_chunks_mut::<2>();
    for pair in pairs {
        activate_block(activation, pair);
    }
    for single in rest.as_chunks_mut::<1>().0 {
        activate_block(activation, single);
    }
}

#[inline(always)]
fn activate_block<V: Vector<N>, const N: usize, const B: usize>(activation: Activation, values: &mut [V; B]) {
    let one = V::splat(V::Real::from_f64(1.0));
    match activation {
        Activation::Logistic => logistic_block(values),
        Activation::Tanh => {
            // tanh(z) = 2 σ(2z) − 1
            for value in values.iter_mut() {
                *value = *value + *value;
            }
            logistic_block(values);
            for value in values.iter_mut() {
                *value = *value + *value - one;
            }
        }
        Activation::Linear => {}
    }
}

#[inline(always)]
pub(crate) fn derivative<V: Vector<N>, const N: usize>(activation: Activation, output: V) -> V {
    let one = V::splat(V::Real::from_f64(1.0));
    match activation {
        Activation::Logistic => output * (one - output),
        Activation::Tanh => one - output * output,
        Activation::Linear => one,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate_numerics::simd::{Arithmetic, Array};

    fn exact(z: f64) -> f64 {
        1.0 / (1.0 + (-z).exp())
    }

    fn values_f64(z: &[f64], activation: Activation) -> Vec<f64> {
        let mut values: Vec<Array<f64, 1, true>> = z.iter().map(|&z| Array::splat(z)).collect();
        activate(activation, &mut values);
        values.into_iter().map(|value| value.to_array()[0]).collect()
    }

    fn sweep() -> Vec<f64> {
        (-4003..=4003).map(|i| f64::from(i) * 0.0101).collect()
    }

    #[test]
    fn the_logistic_function_is_right_to_fourteen_digits() {
        for (z, a) in sweep().into_iter().zip(values_f64(&sweep(), Activation::Logistic)) {
            assert!((a / exact(z) - 1.0).abs() < 3e-14, "σ({z}) = {a}");
        }
    }

    #[test]
    fn single_precision_is_right_to_its_own_digits() {
        let mut values: Vec<Array<f32, 1, true>> =
            sweep().into_iter().map(|z| Array::splat(z as f32)).collect();
        activate(Activation::Logistic, &mut values);
        for (z, a) in sweep().into_iter().zip(values) {
            let a = f64::from(a.to_array()[0]);
            assert!((a - exact(f64::from(z as f32))).abs() < 3e-7, "σ({z}) = {a}");
        }
    }

    #[test]
    fn far_out_it_stays_between_nought_and_one() {
        for z in [1e3, 1e30, f64::MAX] {
            let [low, high] = values_f64(&[-z, z], Activation::Logistic)[..] else { unreachable!() };
            assert!((0.0..1e-100).contains(&low) && high == 1.0, "{low}, {high}");
        }
    }

    #[test]
    fn derivatives_follow_their_functions() {
        let step = 1e-5;
        for activation in [Activation::Logistic, Activation::Tanh, Activation::Linear] {
            for z in [-3.0, -0.4, 0.0, 1.7] {
                let [below, at, above] = values_f64(&[z - step, z, z + step], activation)[..] else {
                    unreachable!()
                };
                let [slope] = derivative(activation, Array::<f64, 1, true>::splat(at)).to_array();
                assert!((slope - (above - below) / (2.0 * step)).abs() < 1e-8, "{activation:?} at {z}");
            }
        }
    }
}
