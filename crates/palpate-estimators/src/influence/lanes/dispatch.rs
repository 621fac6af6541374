//! Picks the widest arithmetic that the machine has, when the program runs.
#![expect(unsafe_code, reason = "calls of functions with target features")]

use super::portable::Array;
use crate::influence::batch::{Rows, locate_each};
use crate::influence::scratch::Scratch;
use crate::influence::search::Search;
use palpate_core::Estimate;

/// An arithmetic that this machine can run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::influence) enum InstructionSet {
    /// AVX-512: eight f64 in a register.
    #[cfg(target_arch = "x86_64")]
    Avx512,
    /// AVX2: eight f64 in two registers.
    #[cfg(target_arch = "x86_64")]
    Avx2,
    /// Arrays that the compiler may vectorise.
    Portable,
}

impl InstructionSet {
    /// The widest that this machine has.
    #[inline(always)]
    fn best() -> Self {
        #[cfg(target_arch = "x86_64")]
        {
            if is_x86_feature_detected!("avx512f") && is_x86_feature_detected!("avx512dq") {
                return Self::Avx512;
            }
            if is_x86_feature_detected!("avx2") {
                return Self::Avx2;
            }
        }
        Self::Portable
    }

    /// Those that this machine has, widest first.
    #[cfg(test)]
    pub fn available() -> Vec<Self> {
        #[cfg(target_arch = "x86_64")]
        let all = [Self::Avx512, Self::Avx2, Self::Portable];
        #[cfg(not(target_arch = "x86_64"))]
        let all = [Self::Portable];
        let widest = all.iter().position(|set| *set == Self::best()).unwrap_or(0);
        all[widest..].to_vec()
    }
}

/// Locates one contact in each row of readings.
pub(in crate::influence) fn locate_rows(
    search: &Search,
    rows: Rows,
    scratch: &mut Scratch,
    estimates: &mut [Estimate],
) {
    // SAFETY: `best` has found the features.
    unsafe { run(InstructionSet::best(), search, rows, scratch, estimates) }
}

/// [`locate_rows`] with `set`; one that the machine lacks is replaced by the portable.
#[cfg(test)]
pub(in crate::influence) fn locate_rows_by(
    set: InstructionSet,
    search: &Search,
    rows: Rows,
    scratch: &mut Scratch,
    estimates: &mut [Estimate],
) {
    let set = if InstructionSet::available().contains(&set) { set } else { InstructionSet::Portable };
    // SAFETY: `available` has found the features.
    unsafe { run(set, search, rows, scratch, estimates) }
}

/// # Safety
/// The machine must have `set`.
#[inline(always)]
unsafe fn run(
    set: InstructionSet,
    search: &Search,
    rows: Rows,
    scratch: &mut Scratch,
    estimates: &mut [Estimate],
) {
    match set {
        #[cfg(target_arch = "x86_64")]
        // SAFETY: the caller has AVX-512.
        InstructionSet::Avx512 => unsafe { by_avx512(search, rows, scratch, estimates) },
        #[cfg(target_arch = "x86_64")]
        // SAFETY: the caller has AVX2.
        InstructionSet::Avx2 => unsafe { by_avx2(search, rows, scratch, estimates) },
        InstructionSet::Portable => locate_each::<Array>(search, rows, scratch, estimates),
    }
}

/// # Safety
/// The machine must have AVX-512 F and DQ.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512dq")]
unsafe fn by_avx512(search: &Search, rows: Rows, scratch: &mut Scratch, estimates: &mut [Estimate]) {
    locate_each::<super::avx512::F64x8>(search, rows, scratch, estimates);
}

/// # Safety
/// The machine must have AVX2.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
unsafe fn by_avx2(search: &Search, rows: Rows, scratch: &mut Scratch, estimates: &mut [Estimate]) {
    locate_each::<super::avx2::F64x8>(search, rows, scratch, estimates);
}
