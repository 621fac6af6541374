use super::*;
use portable::Array;

/// Numbers of both signs and of many sizes.
fn numbers(shift: usize) -> [f64; 8] {
    std::array::from_fn(|i| ((i * 7 + shift * 3) as f64 * 1.3).sin() * 10f64.powi((i + shift) as i32 % 5))
}

/// Operations on two numbers, and on numbers and bits.
#[inline(always)]
fn operations<V: Eight>(a: V, b: V, bits: u8) -> [[f64; 8]; 8] {
    [a + b, a - b, a * b, a / b, a.max(b), a.min(b), a.truncate(), a.or(bits, b)].map(|v| v.lanes())
}

#[cfg(target_arch = "x86_64")]
#[inline(always)]
fn agrees<V: Eight>() {
    for shift in 0..40 {
        let (a, b, c) = (numbers(shift), numbers(shift + 1), numbers(shift + 2));
        let wide = (V::load(&a), V::load(&b), V::load(&c));
        let narrow = (Array::load(&a), Array::load(&b), Array::load(&c));
        let bits = (shift * 37) as u8;
        assert_eq!(operations(wide.0, wide.1, bits), operations(narrow.0, narrow.1, bits));
        assert_eq!(V::splat(a[1]).lanes(), [a[1]; 8]);
        assert_eq!(wide.0.sum(), narrow.0.sum());
        let eight: [[f64; 8]; 8] = std::array::from_fn(|i| numbers(shift + i));
        let sums = V::sums(&eight.map(|values| V::load(&values)));
        assert_eq!(sums.lanes(), eight.map(|values| V::load(&values).sum()));
        assert_eq!(wide.0.at_most(wide.1), narrow.0.at_most(narrow.1));
        assert_eq!(wide.0.at_most(wide.0), u8::MAX);
        assert_eq!(wide.0.is_minimum(wide.1, wide.2), narrow.0.is_minimum(narrow.1, narrow.2));
        assert_eq!(wide.0.is_minimum(wide.0, wide.2), narrow.0.is_minimum(narrow.0, narrow.2));
    }
}

#[cfg(target_arch = "x86_64")]
#[test]
fn every_instruction_set_computes_as_plain_arrays_do() {
    let sets = InstructionSet::available();
    if sets.contains(&InstructionSet::Avx2) {
        agrees::<avx2::F64x8>();
    }
    if sets.contains(&InstructionSet::Avx512) {
        agrees::<avx512::F64x8>();
    }
}

#[test]
fn a_lane_computes_as_a_number_does() {
    for shift in 0..40 {
        let (a, b) = (numbers(shift), numbers(shift + 1));
        let (wide, nan) = ((Array::load(&a), Array::load(&b)), [f64::NAN; 8]);
        let results = operations(wide.0, wide.1, shift as u8);
        for lane in 0..8 {
            let (a, b) = (a[lane], b[lane]);
            let or = a.or(shift as u8 >> lane, b);
            let alone = [a + b, a - b, a * b, a / b, Number::max(a, b), Number::min(a, b), a.truncate(), or];
            assert_eq!(results.map(|lanes| lanes[lane]), alone);
            assert_eq!(a.at_most(b), wide.0.at_most(wide.1) >> lane & 1);
        }
        assert_eq!(Array::load(&nan).max(wide.0).lanes(), a);
        assert_eq!(Array::load(&nan).min(wide.0).lanes(), a);
    }
}
