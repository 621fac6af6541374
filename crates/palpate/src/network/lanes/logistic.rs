//! The activation functions, in every lane at once.

use super::{Lanes, Real};
use crate::network::Activation;
use std::f64::consts::LOG2_E;

/// 1 + exp(−z), by 2^x = 2^n · 2^r with n the whole number next to x and a polynomial in r.
#[inline(always)]
fn denominator<V: Lanes<N>, const N: usize>(z: V) -> V {
    let end = V::splat(V::Real::LOGISTIC_END);
    let zero = V::splat(V::Real::from_f64(0.0));
    let z = z.min(end).max(zero.sub(end));
    let to_binary = V::splat(V::Real::from_f64(-LOG2_E));
    let rounder = V::splat(V::Real::ROUNDER);
    let shifted = z.mul_add(to_binary, rounder);
    let r = z.mul_sub(to_binary, shifted.sub(rounder));
    let mut power = V::splat(V::Real::EXP2[V::Real::EXP2.len() - 1]);
    for &coefficient in V::Real::EXP2.iter().rev().skip(1) {
        power = power.mul_add(r, V::splat(coefficient));
    }
    power.scale_by_power_of_two(shifted).add(V::splat(V::Real::from_f64(1.0)))
}

/// σ(z) = 1 / (1 + exp(−z)) of two values by one division: 1/a = b/(a·b). Division is what bounds the activation on
/// most processors, so halving its count pays for the three multiplications.
#[inline(always)]
fn logistic_pair<V: Lanes<N>, const N: usize>(z: [V; 2]) -> [V; 2] {
    let [a, b] = [denominator(z[0]), denominator(z[1])];
    let inverse = V::splat(V::Real::from_f64(1.0)).div(a.mul(b));
    [b.mul(inverse), a.mul(inverse)]
}

#[inline(always)]
fn logistic<V: Lanes<N>, const N: usize>(values: &mut [V]) {
    let mut pairs = values.chunks_exact_mut(2);
    for pair in &mut pairs {
        let [a, b] = logistic_pair([pair[0], pair[1]]);
        pair[0] = a;
        pair[1] = b;
    }
    for value in pairs.into_remainder() {
        *value = V::splat(V::Real::from_f64(1.0)).div(denominator(*value));
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
