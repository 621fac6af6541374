//! Many readings, eight at a time.
//!
//! One reading alone is a chain: its misfits, its valleys, a place, sums over channels, a division, the next place. The
//! machine waits for each. Of eight readings the chains run side by side: all that is done once a reading, places,
//! divisions and the sums over channels, is done for eight readings in one register, by the code and with the order of
//! sums that one reading has, so the estimates are the same to the last bit. A reading that needs more than the lowest
//! of its valleys, or more than a few steps, goes through the search for one reading.
//!
//! Where the time goes, by sampling: about four tenths into what is still done reading by reading, the scan of coarse
//! nodes, its valleys and where to start in them; about a quarter into the refinement of a known force, a third into that
//! of an unknown one; the rest into whitening and writing estimates.

use super::answer::{conclude, locate_into};
use super::coarse::Profile;
use super::scratch::{ForEight, Scratch};
use super::search::{Minimum, NEGLIGIBLE, Search};
use palpate_core::Estimate;
use palpate_numerics::simd::{Eight, InstructionSet, Kernel, Simd};

/// Readings one after the other, of so many channels each.
#[derive(Clone, Copy)]
pub(super) struct Rows<'a> {
    pub readings: &'a [f64],
    pub channels: usize,
}

/// Steps that eight readings take together; a reading that is not at its minimum then would keep the others waiting.
const MOST_STEPS: usize = 4;

/// Writes the estimate of one contact for each row.
pub(super) fn locate_rows(search: &Search, rows: Rows, scratch: &mut Scratch, estimates: &mut [Estimate]) {
    InstructionSet::best().run(LocateRows { search, rows, scratch, estimates });
}

/// The work of [`locate_rows`].
pub(super) struct LocateRows<'a> {
    pub search: &'a Search,
    pub rows: Rows<'a>,
    pub scratch: &'a mut Scratch,
    pub estimates: &'a mut [Estimate],
}

impl Kernel for LocateRows<'_> {
    type Output = ();
    const FUSED: bool = false;

    #[inline(always)]
    fn run<S: Simd>(self) {
        locate_each::<S::F64>(self.search, self.rows, self.scratch, self.estimates);
    }
}

#[inline(always)]
fn locate_each<V: Eight>(search: &Search, rows: Rows, scratch: &mut Scratch, estimates: &mut [Estimate]) {
    let channels = rows.channels.max(1);
    let count = estimates.len().min(rows.readings.len() / channels);
    let eights = count - count % 8;
    let (readings, rest) = rows.readings.split_at(eights * channels);
    let (estimates, last) = estimates.split_at_mut(eights);
    for (readings, estimates) in readings.chunks_exact(8 * channels).zip(estimates.as_chunks_mut().0) {
        locate_eight::<V>(search, Rows { readings, channels }, scratch, estimates);
    }
    for (reading, estimate) in rest.chunks_exact(channels).zip(last) {
        locate_into::<V>(search, reading, scratch, estimate);
    }
}

/// Writes the estimates of eight readings.
#[inline(always)]
fn locate_eight<V: Eight>(search: &Search, rows: Rows, scratch: &mut Scratch, estimates: &mut [Estimate; 8]) {
    let groups = search.groups();
    scratch.eight.resize(groups);
    let ForEight { whitened, profiles } = &mut scratch.eight;
    let ([mut squares, mut floors], mut nodes) = ([[0.0; 8]; 2], [0; 8]);
    let readings = rows.readings.chunks_exact(rows.channels);
    for (i, (reading, profile)) in readings.clone().zip(&mut *profiles).enumerate() {
        let whitened = &mut whitened[i * groups..][..groups];
        squares[i] = search.whiten::<V>(reading, whitened);
        let lowest = search.lowest_valley::<V>(squares[i], whitened, profile);
        (nodes[i], floors[i]) = lowest.unwrap_or((0, f64::NEG_INFINITY));
    }
    let each: [&Profile; 8] = std::array::from_fn(|i| &profiles[i]);
    let start = search.coarse.start::<V, V>(&each, &nodes);
    let (minima, arrived) = search.refine::<V, V>(whitened, (start.x_m, start.force_n), MOST_STEPS);
    let minima = one_by_one(&minima);
    let mut hard = !arrived;
    for i in 0..8 {
        if floors[i] > minima[i].misfit + NEGLIGIBLE {
            conclude(search, squares[i], &minima[i..=i], &profiles[i], &mut estimates[i]);
        } else {
            hard |= 1 << i;
        }
    }
    for (i, reading) in readings.enumerate() {
        if hard >> i & 1 == 1 {
            locate_into::<V>(search, reading, scratch, &mut estimates[i]);
        }
    }
}

/// The minima of eight readings, reading by reading.
#[inline(always)]
fn one_by_one<V: Eight>(minima: &Minimum<V>) -> [Minimum; 8] {
    let [xx, xf, ff] = minima.covariance;
    let (xx, xf, ff) = (xx.to_array(), xf.to_array(), ff.to_array());
    let x_m = minima.x_m.to_array();
    let (force_n, misfit) = (minima.force_n.to_array(), minima.misfit.to_array());
    let mut each = [Minimum::<f64>::nowhere(); 8];
    for i in 0..8 {
        let covariance = [xx[i], xf[i], ff[i]];
        each[i] = Minimum { x_m: x_m[i], force_n: force_n[i], misfit: misfit[i], covariance };
    }
    each
}
