//! Picks the widest arithmetic that the machine has, when the program runs.
#![expect(unsafe_code, reason = "calls of functions with target features")]

use super::forward::{self, Batch};
use super::portable::Array;
use super::single::{self, Layer};
use super::{Lanes, kernel};
use crate::network::{TrainedNetwork, TrainingQueue, TrainingTask, scalar};
use palpate_numerics::watch::{Cancelled, Watch};

/// Width of a floating-point number in training.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Precision {
    /// 64 bits.
    #[default]
    F64,
    /// 32 bits: twice the lanes.
    F32,
}

/// An arithmetic that this machine can run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum InstructionSet {
    /// AVX-512: 8 f64 or 16 f32 lanes.
    Avx512,
    /// AVX2 with FMA: 4 f64 or 8 f32 lanes.
    Avx2,
    /// Arrays that the compiler may vectorise: 4 f64 or 8 f32 lanes.
    Portable,
}

impl InstructionSet {
    /// Those that this machine has, widest first.
    pub fn available() -> Vec<Self> {
        let mut sets = Vec::new();
        #[cfg(target_arch = "x86_64")]
        {
            if is_x86_feature_detected!("avx512f") && is_x86_feature_detected!("avx512dq") && has_fma() {
                sets.push(Self::Avx512);
            }
            if is_x86_feature_detected!("avx2") && has_fma() {
                sets.push(Self::Avx2);
            }
        }
        sets.push(Self::Portable);
        sets
    }

    /// The widest.
    pub fn best() -> Self {
        Self::available()[0]
    }

    /// Networks that train side by side.
    pub fn lanes(self, precision: Precision) -> usize {
        let f64_lanes = if self == Self::Avx512 { 8 } else { 4 };
        match precision {
            Precision::F64 => f64_lanes,
            Precision::F32 => 2 * f64_lanes,
        }
    }
}

impl std::fmt::Display for InstructionSet {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Avx512 => "AVX-512",
            Self::Avx2 => "AVX2 and FMA",
            Self::Portable => "portable",
        })
    }
}

/// Whether a multiply-add is one rounding on this machine.
fn has_fma() -> bool {
    #[cfg(target_arch = "x86_64")]
    return is_x86_feature_detected!("fma");
    #[cfg(not(target_arch = "x86_64"))]
    return cfg!(target_arch = "aarch64");
}

/// Trains the queue's networks, lane by lane, with `set`, which must be one of [`InstructionSet::available`]; another
/// one is replaced by the portable.
pub(crate) fn train_lanes(
    set: InstructionSet,
    precision: Precision,
    task: &TrainingTask,
    queue: &mut dyn TrainingQueue,
    watch: Watch,
) -> Result<(), Cancelled> {
    let set = if InstructionSet::available().contains(&set) { set } else { InstructionSet::Portable };
    match (set, precision) {
        #[cfg(target_arch = "x86_64")]
        // SAFETY: `available` has found the features.
        (InstructionSet::Avx512, Precision::F64) => unsafe {
            avx512::<super::avx512::F64x8, 8>(task, queue, watch)
        },
        #[cfg(target_arch = "x86_64")]
        // SAFETY: `available` has found the features.
        (InstructionSet::Avx512, Precision::F32) => unsafe {
            avx512::<super::avx512::F32x16, 16>(task, queue, watch)
        },
        #[cfg(target_arch = "x86_64")]
        // SAFETY: `available` has found the features.
        (InstructionSet::Avx2, Precision::F64) => unsafe { fma::<super::avx2::F64x4, 4>(task, queue, watch) },
        #[cfg(target_arch = "x86_64")]
        // SAFETY: `available` has found the features.
        (InstructionSet::Avx2, Precision::F32) => unsafe { fma::<super::avx2::F32x8, 8>(task, queue, watch) },
        (_, Precision::F64) if has_fma() => fused::<Array<f64, 4, true>, 4>(task, queue, watch),
        (_, Precision::F32) if has_fma() => fused::<Array<f32, 8, true>, 8>(task, queue, watch),
        (_, Precision::F64) => kernel::train::<Array<f64, 4, false>, 4>(task, queue, watch),
        (_, Precision::F32) => kernel::train::<Array<f32, 8, false>, 8>(task, queue, watch),
    }
}

/// Trains one network by the scalar twin, in the arithmetic that the lanes of this machine have.
pub(crate) fn train_scalar(
    precision: Precision,
    task: &TrainingTask,
    seed: u64,
    watch: Watch,
) -> Result<TrainedNetwork, Cancelled> {
    match precision {
        Precision::F64 if has_fma() => fused_scalar::<Array<f64, 1, true>>(task, seed, watch),
        Precision::F32 if has_fma() => fused_scalar::<Array<f32, 1, true>>(task, seed, watch),
        Precision::F64 => scalar::train::<Array<f64, 1, false>>(task, seed, watch),
        Precision::F32 => scalar::train::<Array<f32, 1, false>>(task, seed, watch),
    }
}

/// # Safety
/// The machine must have AVX-512 F and DQ.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512dq,fma")]
unsafe fn avx512<V: Lanes<N>, const N: usize>(
    task: &TrainingTask,
    queue: &mut dyn TrainingQueue,
    watch: Watch,
) -> Result<(), Cancelled> {
    kernel::train::<V, N>(task, queue, watch)
}

/// # Safety
/// The machine must have AVX2 and FMA.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
unsafe fn fma<V: Lanes<N>, const N: usize>(
    task: &TrainingTask,
    queue: &mut dyn TrainingQueue,
    watch: Watch,
) -> Result<(), Cancelled> {
    kernel::train::<V, N>(task, queue, watch)
}

/// The kernel where the compiler may use the machine's multiply-add. Call it only where [`has_fma`].
fn fused<V: Lanes<N>, const N: usize>(
    task: &TrainingTask,
    queue: &mut dyn TrainingQueue,
    watch: Watch,
) -> Result<(), Cancelled> {
    #[cfg(target_arch = "x86_64")]
    {
        /// # Safety
        /// The machine must have FMA.
        #[target_feature(enable = "fma")]
        unsafe fn inner<V: Lanes<N>, const N: usize>(
            task: &TrainingTask,
            queue: &mut dyn TrainingQueue,
            watch: Watch,
        ) -> Result<(), Cancelled> {
            kernel::train::<V, N>(task, queue, watch)
        }
        // SAFETY: the caller has asked `has_fma`.
        unsafe { inner::<V, N>(task, queue, watch) }
    }
    #[cfg(not(target_arch = "x86_64"))]
    kernel::train::<V, N>(task, queue, watch)
}

/// The twin where the compiler may use the machine's multiply-add. Call it only where [`has_fma`].
fn fused_scalar<V: Lanes<1>>(
    task: &TrainingTask,
    seed: u64,
    watch: Watch,
) -> Result<TrainedNetwork, Cancelled> {
    #[cfg(target_arch = "x86_64")]
    {
        /// # Safety
        /// The machine must have FMA.
        #[target_feature(enable = "fma")]
        unsafe fn inner<V: Lanes<1>>(
            task: &TrainingTask,
            seed: u64,
            watch: Watch,
        ) -> Result<TrainedNetwork, Cancelled> {
            scalar::train::<V>(task, seed, watch)
        }
        // SAFETY: the caller has asked `has_fma`.
        unsafe { inner::<V>(task, seed, watch) }
    }
    #[cfg(not(target_arch = "x86_64"))]
    scalar::train::<V>(task, seed, watch)
}

/// Sends a batch through its network, a reading a lane, with `set`; another one than [`InstructionSet::available`] has is replaced by the
/// portable.
pub(crate) fn forward_lanes(set: InstructionSet, batch: &Batch<f32>, outputs: &mut [f32]) {
    let set = if InstructionSet::available().contains(&set) { set } else { InstructionSet::Portable };
    match set {
        #[cfg(target_arch = "x86_64")]
        // SAFETY: `available` has found the features.
        InstructionSet::Avx512 => unsafe { forward_avx512(batch, outputs) },
        #[cfg(target_arch = "x86_64")]
        // SAFETY: `available` has found the features.
        InstructionSet::Avx2 => unsafe { forward_fma(batch, outputs) },
        _ => forward::run::<Array<f32, 8, false>, 8, 10>(batch, outputs),
    }
}

/// # Safety
/// The machine must have AVX-512 F and DQ.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512dq,fma")]
unsafe fn forward_avx512(batch: &Batch<f32>, outputs: &mut [f32]) {
    forward::run::<super::avx512::F32x16, 16, 8>(batch, outputs);
}

/// # Safety
/// The machine must have AVX2 and FMA.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
unsafe fn forward_fma(batch: &Batch<f32>, outputs: &mut [f32]) {
    forward::run::<super::avx2::F32x8, 8, 8>(batch, outputs);
}

/// Sends one reading through the layers of a network; see [`single::run`].
pub(crate) fn forward_one(layers: &[Layer], inputs: &[f64], outputs: &mut [f64]) {
    #[cfg(target_arch = "x86_64")]
    if is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma") {
        // SAFETY: the features have just been found.
        return unsafe { forward_one_avx2(layers, inputs, outputs) };
    }
    forward_one_portable(layers, inputs, outputs);
}

/// The twin of [`forward_one`] for every machine.
pub(crate) fn forward_one_portable(layers: &[Layer], inputs: &[f64], outputs: &mut [f64]) {
    single::run::<Array<f64, 4, false>>(layers, inputs, outputs);
}

/// # Safety
/// The machine must have AVX2 and FMA.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
unsafe fn forward_one_avx2(layers: &[Layer], inputs: &[f64], outputs: &mut [f64]) {
    single::run::<super::avx2::F64x4>(layers, inputs, outputs);
}
