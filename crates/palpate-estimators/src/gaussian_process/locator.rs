//! A fitted Gaussian process: features and posterior, all that a reading needs to become a position.

use palpate_core::{ContactEstimate, Estimate, Status, Uncertainty};

use crate::features::Features;
use crate::fit::{Locate, LocatorFault};
use crate::setup::Setup;
use palpate_mechanics::contact::Position;
use palpate_mechanics::surface::Extent;
use palpate_numerics::normal_interval_95;
use palpate_numerics::regression::GaussianProcess;

/// A Gaussian process that locates.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GaussianProcessLocator {
    /// What it sees of a reading.
    pub features: Features,
    /// The posterior of x, and of y where the surface has a width, in metres.
    pub process: GaussianProcess,
    /// The surface.
    pub extent: Extent,
    /// The contact's force in newtons, where it is known.
    pub force_n: Option<f64>,
}

impl Locate for GaussianProcessLocator {
    /// The posterior mean, with the variance of the contact's position: that of the function, and the fitted error of
    /// a single row besides.
    fn locate(&self, reading: &[f64]) -> Estimate {
        let (means_m, variances_m2) = self.process.predict(&self.features.apply(reading));
        let coordinate = |j: usize| -> Option<(f64, f64)> {
            let error_m2 = self.process.noise_variance(j).unwrap_or(0.0);
            Some((*means_m.get(j)?, variances_m2.get(j)? + error_m2))
        };
        let (x_m, x_m2) = coordinate(0).unwrap_or_default();
        let (y_m, y_m2) = if self.process.outputs() > 1 { coordinate(1) } else { None }.unwrap_or_default();
        let uncertainty = Uncertainty {
            covariance: [x_m2, 0.0, 0.0, y_m2, 0.0, 0.0],
            x_95_m: normal_interval_95(x_m, x_m2.sqrt()),
            y_95_m: normal_interval_95(y_m, y_m2.sqrt()),
        };
        let position = Position { x_m, y_m };
        let status = if self.extent.contains(position) { Status::Located } else { Status::OutsideSurface };
        let contact = ContactEstimate { position, force_n: self.force_n, uncertainty: Some(uncertainty) };
        Estimate::of_contact(contact, status)
    }

    fn check(&self, setup: &Setup) -> Result<(), LocatorFault> {
        self.features.check(setup.layout.len())?;
        let coordinates = self.process.coordinates();
        LocatorFault::check_count("coordinates of its Gaussian process", self.features.len(), coordinates)?;
        let outputs = 1 + usize::from(setup.surface.extent().width_m.is_some());
        LocatorFault::check_count("outputs", outputs, self.process.outputs())?;
        let sizes = [self.extent.length_m].into_iter().chain(self.extent.width_m);
        LocatorFault::check_numbers("extent", sizes, |size| size > 0.0, "finite and greater than 0")?;
        LocatorFault::check_numbers("force", self.force_n, |force| force > 0.0, "finite and greater than 0")
    }
}
