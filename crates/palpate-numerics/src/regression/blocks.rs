//! Predictions in blocks of eight points.

use super::Kernel;
use crate::simd::{Arithmetic, InstructionSet, Kernel as Work, Simd, Vector};
use ndarray::{Array2, ArrayView2};

#[derive(Clone, Debug)]
pub(super) struct Blocks {
    kernel: Kernel,
    coordinates: usize,
    outputs: usize,
    /// u by block and coordinate.
    points: Vec<[f64; 8]>,
    /// α by block and output.
    weights: Vec<[f64; 8]>,
}

impl Blocks {
    pub fn new(kernel: Kernel, scaled: &ArrayView2<f64>, weights: &ArrayView2<f64>) -> Self {
        Self {
            kernel,
            coordinates: scaled.nrows(),
            outputs: weights.nrows(),
            points: in_blocks(scaled),
            weights: in_blocks(weights),
        }
    }

    pub fn len(&self) -> usize {
        self.points.len() / self.coordinates.max(1)
    }

    /// Correlations with u, and Σ α_i·c_i of every output.
    pub fn sums_into(&self, u: &[f64], correlations: &mut [[f64; 8]], sums: &mut [f64]) {
        let work = Sums { blocks: self, u, correlations, sums };
        InstructionSet::best().run(work);
    }
}

fn in_blocks(matrix: &ArrayView2<f64>) -> Vec<[f64; 8]> {
    let (rows, columns) = matrix.dim();
    let mut blocks = vec![[0.0; 8]; rows * columns.div_ceil(8)];
    for ((row, column), value) in matrix.indexed_iter() {
        blocks[column / 8 * rows + row][column % 8] = *value;
    }
    blocks
}

struct Sums<'a> {
    blocks: &'a Blocks,
    u: &'a [f64],
    correlations: &'a mut [[f64; 8]],
    sums: &'a mut [f64],
}

impl Work for Sums<'_> {
    type Output = ();
    const FUSED: bool = true;

    #[inline(always)]
    fn run<S: Simd>(self) {
        match self.blocks.kernel {
            Kernel::Matern52 => self.over_points::<S::F64>(matern_52),
            Kernel::Matern32 => self.over_points::<S::F64>(matern_32),
            Kernel::SquaredExponential => self.over_points::<S::F64>(squared_exponential),
        }
    }
}

impl Sums<'_> {
    const OUTPUTS: usize = 4;

    #[inline(always)]
    fn over_points<V: Vector<8, Real = f64>>(self, correlation: impl Fn(V) -> V) {
        let Blocks { coordinates, outputs, points, weights, .. } = self.blocks;
        for (points, out) in points.chunks_exact((*coordinates).max(1)).zip(&mut *self.correlations) {
            let mut r2 = V::splat(0.0);
            for (point, u) in points.iter().zip(self.u) {
                let off = V::load(point) - V::splat(*u);
                r2 = off.mul_add(off, r2);
            }
            *out = correlation(r2).to_array();
        }
        for start in (0..*outputs).step_by(Self::OUTPUTS) {
            let count = (outputs - start).min(Self::OUTPUTS);
            let mut sums = [V::splat(0.0); Self::OUTPUTS];
            for (weights, correlations) in weights.chunks_exact(*outputs).zip(&*self.correlations) {
                let c = V::load(correlations);
                for (sum, weight) in sums[..count].iter_mut().zip(&weights[start..start + count]) {
                    *sum = c.mul_add(V::load(weight), *sum);
                }
            }
            for (out, sum) in self.sums[start..start + count].iter_mut().zip(sums) {
                *out = sum.to_array().iter().sum();
            }
        }
    }
}

#[inline(always)]
fn matern_52<V: Vector<8, Real = f64>>(r2: V) -> V {
    let n = V::splat;
    let scaled = (n(5.0) * r2).square_root().min(n(600.0));
    let polynomial = scaled.mul_add(scaled.mul_add(n(1.0 / 3.0), n(1.0)), n(1.0));
    polynomial * (n(0.0) - scaled).exponential()
}

#[inline(always)]
fn matern_32<V: Vector<8, Real = f64>>(r2: V) -> V {
    let n = V::splat;
    let scaled = (n(3.0) * r2).square_root().min(n(600.0));
    (scaled + n(1.0)) * (n(0.0) - scaled).exponential()
}

#[inline(always)]
fn squared_exponential<V: Vector<8, Real = f64>>(r2: V) -> V {
    (V::splat(-0.5) * r2).exponential()
}

#[derive(Clone, Debug)]
pub(super) struct Triangle {
    blocks: Vec<Vec<[f64; 8]>>,
}

impl Triangle {
    pub fn new(matrix: &ArrayView2<f64>) -> Self {
        let size = matrix.nrows();
        let block = |first: usize| {
            let column = |j: usize| {
                std::array::from_fn(|lane| {
                    let i = first + lane;
                    if i < size && j <= i { matrix[[i, j]] } else { 0.0 }
                })
            };
            (0..(first + 8).min(size)).map(column).collect()
        };
        Self { blocks: (0..size).step_by(8).map(block).collect() }
    }

    /// Writes T·x and returns |T·x|².
    pub fn product_into(&self, x: &[f64], out: &mut [[f64; 8]]) -> f64 {
        InstructionSet::best().run(Product { triangle: self, x, out })
    }
}

struct Product<'a> {
    triangle: &'a Triangle,
    x: &'a [f64],
    out: &'a mut [[f64; 8]],
}

impl Work for Product<'_> {
    type Output = f64;
    const FUSED: bool = true;

    #[inline(always)]
    fn run<S: Simd>(self) -> f64 {
        let mut square = S::F64::splat(0.0);
        for (block, out) in self.triangle.blocks.iter().zip(self.out) {
            // Four sums hide the latency of a multiply-add.
            let mut sums = [S::F64::splat(0.0); 4];
            let (columns, rest) = block.as_chunks::<4>();
            let (x, x_rest) = self.x.as_chunks::<4>();
            for (columns, x) in columns.iter().zip(x) {
                for ((sum, column), x) in sums.iter_mut().zip(columns).zip(x) {
                    *sum = S::F64::load(column).mul_add(S::F64::splat(*x), *sum);
                }
            }
            // Only the last block ends within four columns.
            let x_rest = x.get(columns.len()).map_or(x_rest, |x| &x[..]);
            for (column, x) in rest.iter().zip(x_rest) {
                sums[0] = S::F64::load(column).mul_add(S::F64::splat(*x), sums[0]);
            }
            let sum = (sums[0] + sums[1]) + (sums[2] + sums[3]);
            square = sum.mul_add(sum, square);
            *out = sum.to_array();
        }
        square.to_array().iter().sum()
    }
}

/// Correlations of places (rows) with points (columns).
pub(super) fn cross_correlations(
    kernel: Kernel,
    places: &ArrayView2<f64>,
    points: &ArrayView2<f64>,
) -> Array2<f64> {
    let none = Array2::zeros((0, points.ncols()));
    let blocks = Blocks::new(kernel, points, &none.view());
    let mut correlations = vec![[0.0; 8]; blocks.len()];
    let mut out = Array2::zeros((places.ncols(), points.ncols()));
    for (place, mut row) in places.columns().into_iter().zip(out.outer_iter_mut()) {
        blocks.sums_into(&place.to_vec(), &mut correlations, &mut []);
        row.iter_mut().zip(correlations.as_flattened()).for_each(|(out, c)| *out = *c);
    }
    out
}
