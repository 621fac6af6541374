use super::*;
use crate::likelihood::{CalibrationVariance, Linearisation};
use palpate_mechanics::surface::Extent;

#[test]
fn creep_is_subtracted() {
    let creep = Creep { share: 0.08, time_s: 4.0 };
    let mut state = SlowState::new(&SilentModel(2), 2, None, Some(creep));
    let (mut z, every_s) = ([0.0; 2], 0.05);
    for i in 0..2000_u32 {
        let fresh = if (i / 400) % 2 == 1 { [30.0, -4.0] } else { [0.0; 2] };
        let way = -(-every_s / creep.time_s).exp_m1();
        let way = if i == 0 { 0.0 } else { way };
        let mut reading: [f64; 2] = std::array::from_fn(|c| {
            z[c] += way * (fresh[c] - z[c]);
            fresh[c] + creep.share * z[c]
        });
        let mut whitened = reading;
        state.subtract(f64::from(i) * every_s, (i > 0).then_some(every_s), &mut whitened, &mut reading);
        for c in 0..2 {
            assert!((whitened[c] - fresh[c]).abs() < 1e-9 && (reading[c] - fresh[c]).abs() < 1e-9, "{i}");
        }
    }
}

pub(super) struct SilentModel(pub usize);

impl Likelihood for SilentModel {
    fn geometry(&self) -> crate::likelihood::Geometry<'_> {
        unreachable!("no tracker asks")
    }

    fn whiten(&self, reading: &[f64], whitened: &mut Vec<f64>) {
        whitened.clear();
        whitened.extend(reading);
    }

    fn fit_untouched(&self, _: &[f64], _: f64) -> crate::likelihood::ContactFit<1> {
        unreachable!("no tracker asks")
    }

    fn signal(&self, _: Contact) -> f64 {
        0.0
    }

    fn calibration_variance(&self, _: &[Contact]) -> [CalibrationVariance; 2] {
        [CalibrationVariance::default(); 2]
    }

    fn linearised(&self, _: &[Contact]) -> Linearisation {
        let zeros = vec![0.0; self.0];
        Linearisation { reading: zeros.clone(), derivatives: Vec::new(), variance: zeros }
    }

    fn is_residue(&self, _: &[f64]) -> bool {
        false
    }

    fn interval_check(&self) -> Option<&crate::interval_check::IntervalCheck> {
        None
    }

    fn untouched_drift(&self) -> Option<&UntouchedDrift> {
        None
    }

    fn single_estimate(&self, _: &[f64]) -> palpate_core::Estimate {
        unreachable!("no tracker asks")
    }

    fn extent(&self) -> Extent {
        Extent::line(1.0).unwrap()
    }

    fn known_force_n(&self) -> Option<f64> {
        None
    }

    fn force_range(&self) -> Option<crate::force_prior::ForceRange> {
        None
    }

    fn most_contacts(&self) -> usize {
        1
    }
}
