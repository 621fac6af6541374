//! The activation functions, in every lane at once.

use super::{Lanes, Real};
use crate::network::Activation;
use std::f64::consts::LOG2_E;

/// Values that are worked on together: enough independent multiply-adds to keep two units busy over the latency of
/// one, and the founding paper's ten hidden nodes in one go.
const BLOCK: usize = 10;

/// 1 + exp(−z) of B values in step, by 2^x = 2^n · 2^r with n the whole number next to x and a polynomial in r.
#[inline(always)]
fn denominators<V: Lanes<N>, const N: usize, const B: usize>(z: [V; B]) -> [V; B] {
    let number = |x: f64| V::splat(V::Real::from_f64(x));
    let (end, to_binary) = (V::splat(V::Real::LOGISTIC_END), number(-LOG2_E));
    let rounder = V::splat(V::Real::ROUNDER);
    let lowest = number(0.0).sub(end);
    let (mut shifted, mut r) = (z, z);
    for i in 0..B {
        let z = z[i].min(end).max(lowest);
        shifted[i] = z.mul_add(to_binary, rounder);
        r[i] = z.mul_sub(to_binary, shifted[i].sub(rounder));
    }
    let mut power = [V::splat(V::Real::EXP2[V::Real::EXP2.len() - 1]); B];
    for &coefficient in V::Real::EXP2.iter().rev().skip(1) {
        for i in 0..B {
            power[i] = power[i].mul_add(r[i], V::splat(coefficient));
        }
    }
    for i in 0..B {
        power[i] = power[i].scale_by_power_of_two(shifted[i]).add(number(1.0));
    }
    power
}

/// σ(z) = 1 / (1 + exp(−z)) of B values, each two by one division: 1/a = b/(a·b). The divider is the slowest unit
/// that activation needs, so halving its work pays for the multiplications.
#[inline(always)]
fn logistic_block<V: Lanes<N>, const N: usize, const B: usize>(values: &mut [V; B]) {
    let one = V::splat(V::Real::from_f64(1.0));
    let denominators = denominators(*values);
    for i in (0..B - B % 2).step_by(2) {
        let [a, b] = [denominators[i], denominators[i + 1]];
        let inverse = one.div(a.mul(b));
        [values[i], values[i + 1]] = [b.mul(inverse), a.mul(inverse)];
    }
    if B % 2 == 1 {
        values[B - 1] = one.div(denominators[B - 1]);
    }
}

#[inline(always)]
fn logistic<V: Lanes<N>, const N: usize>(values: &mut [V]) {
    let (blocks, rest) = values.as_chunks_mut::<BLOCK>();
    for block in blocks {
        logistic_block(block);
    }
    let (pairs, rest) = rest.as_chunks_mut::<2>();
    for pair in pairs {
        logistic_block(pair);
    }
    for single in rest.as_chunks_mut::<1>().0 {
        logistic_block(single);
    }
}

/// Replaces a layer's weighted sums by its outputs.
#[inline(always)]
pub(crate) fn activate<V: Lanes<N>, const N: usize>(activation: Activation, values: &mut [V]) {
    let one = V::splat(V::Real::from_f64(1.0));
    match activation {
        Activation::Logistic => logistic(values),
        Activation::Tanh => {
            // tanh(z) = 2 σ(2z) − 1
            for value in values.iter_mut() {
                *value = value.add(*value);
            }
            logistic(values);
            for value in values.iter_mut() {
                *value = value.add(*value).sub(one);
            }
        }
        Activation::Linear => {}
    }
}

/// The derivative of the activation, from its output.
#[inline(always)]
pub(crate) fn derivative<V: Lanes<N>, const N: usize>(activation: Activation, output: V) -> V {
    let one = V::splat(V::Real::from_f64(1.0));
    match activation {
        Activation::Logistic => output.mul(one.sub(output)),
        Activation::Tanh => one.sub(output.mul(output)),
        Activation::Linear => one,
    }
}
