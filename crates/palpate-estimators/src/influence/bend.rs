//! How far a Gauss–Newton step may go to be the last.
//!
//! Symbols as in [`super::search`], all weighted, and m a step of the position, σ² the position's variance, |e|² = χ².
//! Where the force is not known it is the best at its place, and makes up for the part of f′ along f, which is c·f; g is
//! the rest.
//!
//! A step takes W·f(a) for straight. What it leaves out is, along g, W·|g|·(½f″·g/|g|² − c)·m², and as f″ turns g, a
//! residual across f and g is taken for a step of m·(e·f″)/(W·|g|²). So with κ the larger of |½f″·g/|g|² − c| and
//! |f″ across f and g|/|g|, the position is off by less than κ|m|·(|m| + σ|e|); mostly much less, as a residual of noise
//! is hardly ever along f″. Along f, where the force follows as W/(1 + c·m), it leaves out W·|f|·λ·m² with
//! λ = |½f″·f|/|f|².

use super::belief::ForceBelief;
use super::lanes::Number;
use super::table::{Cell, InfluenceTable};
use palpate_numerics::small::add_outer;

/// How the influences bend in a cell of the table.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Bend<N = f64> {
    /// κ², in m⁻².
    pub kappa_square: N,
    /// λ², in m⁻⁴; 0 where the force is known.
    pub lambda_square: N,
}

/// A step to a minimum.
#[derive(Clone, Copy, Debug)]
pub(super) struct Step<N> {
    /// m².
    pub square: N,
    /// σ².
    pub variance: N,
    /// χ² after the step.
    pub misfit: N,
    /// W²·|f|²; 0 where the force is known.
    pub signal: N,
}

impl<N: Number> Bend<N> {
    /// Whether a step leaves so little that it may be the last, a bit for each reading: less than a twentieth of the
    /// position's standard deviation along g, and less than a tenth of the misfit's unit along f. The calibration's
    /// variance counts `grown` times as much as where κ was found, and weighs channels against each other by no more.
    #[inline(always)]
    pub fn allows(&self, step: &Step<N>, grown: N) -> u8 {
        const SHARE_OF_SD: f64 = 0.05;
        const MISFIT: f64 = 0.1;
        // Two: the square of a sum is at most twice the sum of squares.
        let share = N::splat(SHARE_OF_SD * SHARE_OF_SD / 2.0);
        let off =
            self.kappa_square * grown * grown * step.square * (step.square + step.variance * step.misfit);
        let along = step.signal * self.lambda_square * step.square * step.square;
        off.at_most(share * step.variance) & along.at_most(N::splat(MISFIT))
    }
}

/// How a whitened table bends in every cell; `weights` of the cells' channels, in groups of eight.
pub(super) fn bends(table: &InfluenceTable, weights: &[[f64; 8]], force: ForceBelief) -> Vec<Bend> {
    const PARTS: usize = 4;
    let groups = table.sensors.div_ceil(8);
    let cells = weights.chunks_exact(groups).enumerate();
    cells
        .map(|(cell, weights)| {
            let at =
                |part: usize| bend(table, weights.as_flattened(), force, cell, part as f64 / PARTS as f64);
            (0..=PARTS).map(at).fold(Bend { kappa_square: 0.0, lambda_square: 0.0 }, |a, b| Bend {
                kappa_square: a.kappa_square.max(b.kappa_square),
                lambda_square: a.lambda_square.max(b.lambda_square),
            })
        })
        .collect()
}

/// At part `t` of a cell; infinite where a reading does not tell the position.
fn bend(table: &InfluenceTable, weights: &[f64], force: ForceBelief, cell: usize, t: f64) -> Bend {
    let h_m = table.spacing_m();
    let place = Cell { node: cell as f64, ..table.spacing().cell(t * h_m) };
    // Products of f, f′ and f″.
    let mut products = [[0.0; 3]; 3];
    table.for_each(place, |s, f, slope| {
        let rise = (table.at_node(cell + 1)[s] - table.at_node(cell)[s]) / h_m;
        let [left, right] = [cell, cell + 1].map(|node| table.slopes[node * table.sensors + s]);
        let bent = ((6.0 - 12.0 * t) * rise + (6.0 * t - 4.0) * left + (6.0 * t - 2.0) * right) / h_m;
        add_outer(&mut products, weights[s], &[f, slope, bent]);
    });
    let [[ff, fs, fb], [_, ss, sb], [.., bb]] = products;
    // What of f′ and of f″ is along f, per f.
    let [c, along_f] = match force {
        ForceBelief::Known(_) => [0.0; 2],
        _ => [fs / ff, fb / ff],
    };
    let (gg, gb) = (ss - c * fs, sb - c * fb);
    let across = (bb - along_f * fb - gb * gb / gg).max(0.0) / gg;
    let bend = Bend {
        kappa_square: (0.5 * gb / gg - c).powi(2).max(across),
        lambda_square: (0.5 * along_f).powi(2),
    };
    let told = gg > 0.0 && bend.kappa_square.is_finite() && bend.lambda_square.is_finite();
    if told { bend } else { Bend { kappa_square: f64::INFINITY, lambda_square: f64::INFINITY } }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_circle_bends_as_its_radius_says() {
        // Two channels that go round a circle in 40 m, cosine and sine: f″ is across f′ and (2π/40)² of f, which a
        // change of the force makes up for.
        let turn = std::f64::consts::TAU / 40.0;
        let nodes = || (0..401).map(|node| f64::from(node) * 0.1 * turn);
        let table = InfluenceTable {
            sensors: 2,
            length_m: 40.0,
            values: nodes().flat_map(|angle| [angle.cos(), angle.sin()]).collect(),
            slopes: nodes().flat_map(|angle| [-turn * angle.sin(), turn * angle.cos()]).collect(),
            variances: vec![0.0; 802],
        };
        let weights = vec![[1.0; 8]; 400];
        for (force, kappa, lambda) in
            [(ForceBelief::Known(1.0), turn, 0.0), (ForceBelief::Unknown, 0.0, 0.5 * turn * turn)]
        {
            for bend in bends(&table, &weights, force) {
                assert!((bend.kappa_square.sqrt() - kappa).abs() < 1e-2 * turn, "{bend:?}, {force:?}");
                assert!(
                    (bend.lambda_square.sqrt() - lambda).abs() < 1e-2 * turn * turn,
                    "{bend:?}, {force:?}"
                );
            }
        }
    }
}
