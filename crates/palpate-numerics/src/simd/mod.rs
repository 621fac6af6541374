//! Vectors for the instruction sets of a machine. [`InstructionSet::run`] compiles a [`Kernel`] for each:
//!
//! ```
//! use palpate_numerics::simd::{Arithmetic, InstructionSet, Kernel, Simd, Vector};
//!
//! /// a·x + y of rows of eight numbers.
//! struct ScaledSum<'a> { a: f64, x: &'a [[f64; 8]], y: &'a mut [[f64; 8]] }
//!
//! impl Kernel for ScaledSum<'_> {
//!     type Output = ();
//!     const FUSED: bool = true;
//!
//!     #[inline(always)] // Inlined into a function that is compiled for S, its vectors stay in registers.
//!     fn run<S: Simd>(self) {
//!         for (x, y) in self.x.iter().zip(self.y) {
//!             *y = S::F64::splat(self.a).mul_add(S::F64::load(x), S::F64::load(y)).to_array();
//!         }
//!     }
//! }
//!
//! let mut y = [[1.0; 8]];
//! InstructionSet::best().run(ScaledSum { a: 2.0, x: &[[3.0; 8]], y: &mut y });
//! assert_eq!(y, [[7.0; 8]]);
//! ```
//!
//! All sets give equal bits: operations round by IEEE 754, and sums have one order.
#![allow(unsafe_code, reason = "instructions that the machine was asked for")]

mod array;
mod vector;
#[cfg(target_arch = "x86_64")]
mod x86;

pub use array::Array;
pub use vector::{Arithmetic, EightLanes, LOOK_UP, Number, Real, RowLanes, Vector};

/// Work that is written once for every instruction set.
pub trait Kernel {
    /// Result of the work.
    type Output;
    /// True with [`Vector::mul_add`] or [`Vector::mul_sub`].
    const FUSED: bool;
    /// Runs it. This function and time-critical callees must be `#[inline(always)]`.
    fn run<S: Simd>(self) -> Self::Output;
}

/// The vectors of an instruction set.
pub trait Simd {
    /// Eight f64.
    type F64: EightLanes;
    /// Sixteen f32.
    type F32: Vector<16, Real = f32>;
    /// N numbers.
    type Array<R: Real, const N: usize>: Vector<N, Real = R>;
    /// Vectors that fit into the registers.
    const REGISTERS: usize;
}

/// An instruction set of this machine.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct InstructionSet(Set);

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Set {
    #[cfg(target_arch = "x86_64")]
    Avx512,
    #[cfg(target_arch = "x86_64")]
    Avx2,
    Portable,
}

impl InstructionSet {
    /// Arrays, for every machine.
    pub const PORTABLE: Self = Self(Set::Portable);

    /// Returns the widest set of this machine.
    #[inline]
    pub fn best() -> Self {
        #[cfg(target_arch = "x86_64")]
        {
            if has_avx512() {
                return Self(Set::Avx512);
            }
            if has_avx2() {
                return Self(Set::Avx2);
            }
        }
        Self::PORTABLE
    }

    /// Returns the sets of this machine, widest first.
    pub fn available() -> Vec<Self> {
        #[cfg(target_arch = "x86_64")]
        let wide = [(has_avx512(), Set::Avx512), (has_avx2(), Set::Avx2)];
        #[cfg(not(target_arch = "x86_64"))]
        let wide = [];
        let wide = wide.into_iter().filter_map(|(has_it, set)| has_it.then_some(Self(set)));
        wide.chain([Self::PORTABLE]).collect()
    }

    /// Runs a kernel.
    #[inline(always)]
    pub fn run<K: Kernel>(self, kernel: K) -> K::Output {
        match self.0 {
            #[cfg(target_arch = "x86_64")]
            // SAFETY: this set exists only where `best` or `available` has found AVX-512 F and DQ and FMA.
            Set::Avx512 => unsafe { compiled_for_avx512::<K>(kernel) },
            #[cfg(target_arch = "x86_64")]
            // SAFETY: this set exists only where `best` or `available` has found AVX2 and FMA.
            Set::Avx2 => unsafe { compiled_for_avx2::<K, Avx2>(kernel) },
            Set::Portable if K::FUSED => run_loops(kernel),
            Set::Portable => kernel.run::<Portable<NATIVE_FMA>>(),
        }
    }
}

impl std::fmt::Display for InstructionSet {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self.0 {
            #[cfg(target_arch = "x86_64")]
            Set::Avx512 => "AVX-512",
            #[cfg(target_arch = "x86_64")]
            Set::Avx2 => "AVX2 and FMA",
            Set::Portable => "portable",
        })
    }
}

/// Runs a kernel with arrays, for AVX2 and FMA where available.
#[inline(always)]
pub fn run_loops<K: Kernel>(kernel: K) -> K::Output {
    #[cfg(target_arch = "x86_64")]
    if has_avx2() {
        // SAFETY: the features have just been found.
        return unsafe { compiled_for_avx2::<K, Portable<true>>(kernel) };
    }
    kernel.run::<Portable<NATIVE_FMA>>()
}

/// True for architectures with fused multiply-add.
const NATIVE_FMA: bool = cfg!(target_arch = "aarch64");

#[cfg(target_arch = "x86_64")]
#[inline(always)]
fn has_avx512() -> bool {
    is_x86_feature_detected!("avx512f")
        && is_x86_feature_detected!("avx512dq")
        && is_x86_feature_detected!("fma")
}

#[cfg(target_arch = "x86_64")]
#[inline(always)]
fn has_avx2() -> bool {
    is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma")
}

/// # Safety
/// The machine must have AVX-512 F and DQ and FMA.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512dq,fma")]
unsafe fn compiled_for_avx512<K: Kernel>(kernel: K) -> K::Output {
    kernel.run::<Avx512>()
}

/// # Safety
/// The machine must have AVX2 and FMA.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
unsafe fn compiled_for_avx2<K: Kernel, S: Simd>(kernel: K) -> K::Output {
    kernel.run::<S>()
}

/// One register per vector.
#[cfg(target_arch = "x86_64")]
struct Avx512;

#[cfg(target_arch = "x86_64")]
impl Simd for Avx512 {
    type F64 = x86::Avx512F64;
    type F32 = x86::Avx512F32;
    type Array<R: Real, const N: usize> = Array<R, N, true>;
    const REGISTERS: usize = 32;
}

/// Two registers per vector, to hide latency.
#[cfg(target_arch = "x86_64")]
struct Avx2;

#[cfg(target_arch = "x86_64")]
impl Simd for Avx2 {
    type F64 = x86::Avx2F64;
    type F32 = x86::Avx2F32;
    type Array<R: Real, const N: usize> = Array<R, N, true>;
    const REGISTERS: usize = 8;
}

struct Portable<const FUSED: bool>;

impl<const FUSED: bool> Simd for Portable<FUSED> {
    type F64 = Array<f64, 8, FUSED>;
    type F32 = Array<f32, 16, FUSED>;
    type Array<R: Real, const N: usize> = Array<R, N, FUSED>;
    const REGISTERS: usize = 4;
}

#[cfg(test)]
mod tests;
