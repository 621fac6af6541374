//! Every estimator behind one type: fitting whichever it is.

use super::{Estimator, FitError, Method, choose};
use crate::fit::{Fit, FitTask, Fitted, SeedQueue};

impl Fit for Estimator {
    type Method = Method;
    type Error = FitError;

    fn fit_method(&self, task: FitTask) -> Result<Method, FitError> {
        Ok(match self {
            Self::Network(network) => network.fit_method(task)?.into(),
            Self::NetworkLm(networks) => networks.fit_method(task)?.into(),
            Self::Influence(influence) => influence.fit_method(task)?.into(),
            Self::GaussianProcess(process) => process.fit_method(task)?.into(),
            Self::ClosedForm(form) => form.fit_method(task)?.into(),
            Self::Digit(digit) => digit.fit_method(task)?.into(),
            Self::Neighbours(neighbours) => neighbours.fit_method(task)?.into(),
            Self::Centroid(centroid) => centroid.fit_method(task)?.into(),
            Self::Auto => choose(task)?.best.fit_method(task)?,
        })
    }

    fn fit_many(&self, task: FitTask, queue: &mut dyn SeedQueue<Method>) -> Result<(), FitError> {
        match self {
            Self::Network(network) => many(network, task, queue),
            Self::NetworkLm(networks) => many(networks, task, queue),
            Self::Influence(influence) => many(influence, task, queue),
            Self::GaussianProcess(process) => many(process, task, queue),
            Self::ClosedForm(form) => many(form, task, queue),
            Self::Digit(digit) => many(digit, task, queue),
            Self::Neighbours(neighbours) => many(neighbours, task, queue),
            Self::Centroid(centroid) => many(centroid, task, queue),
            Self::Auto => choose(task)?.best.fit_many(task, queue),
        }
    }
}

fn many<E: Fit>(estimator: &E, task: FitTask, queue: &mut dyn SeedQueue<Method>) -> Result<(), FitError>
where
    Method: From<E::Method>,
    FitError: From<E::Error>,
{
    Ok(estimator.fit_many(task, &mut AnyMethod(queue))?)
}

/// A queue of any method as a queue of one.
struct AnyMethod<'a>(&'a mut dyn SeedQueue<Method>);

impl<M> SeedQueue<M> for AnyMethod<'_>
where
    Method: From<M>,
{
    fn next_seed(&mut self) -> Option<u64> {
        self.0.next_seed()
    }

    fn fitted(&mut self, seed: u64, locator: Fitted<M>) {
        self.0.fitted(seed, locator.map(Method::from));
    }
}
