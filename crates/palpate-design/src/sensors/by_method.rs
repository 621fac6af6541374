//! One layout, by the method that is asked for.

use crate::sensors::DesignCriterion;
use palpate_numerics::watch::{Cancelled, Watch};

use super::{DesignError, Designed, Method, SensorProblem, exhaustive, genetic, refine};

impl SensorProblem<'_> {
    /// The layout by one method; a refined one starts from the better of exchange and genetic search.
    ///
    /// # Errors
    /// As [`SensorProblem::assess`], and [`DesignError::NoLayout`] where the method has none: even layouts of reaction sensors, QR
    /// layouts that constraints leave no room for.
    pub fn by_method(&self, method: Method, seed: u64, watch: Watch) -> Result<Designed, DesignError> {
        let none = || DesignError::NoLayout { method: method.name() };
        let found = match method {
            Method::Even => return self.even()?.ok_or_else(none),
            Method::Rig => return self.own(None)?.ok_or_else(none),
            Method::GreedyExchange => return self.greedy_exchange(seed, watch),
            // Then it is what the criterion asks for.
            Method::DOptimal if self.pool.design.criterion == DesignCriterion::DOptimality => {
                self.exchanged(&*self.objective, seed, watch)?
            }
            Method::DOptimal | Method::PrincipalComponents | Method::QrPivoting => {
                let others = self.historical(seed, watch)?;
                let asked = others.into_iter().find(|designed| designed.method == method);
                return asked.ok_or_else(none);
            }
            Method::Exhaustive => {
                let slots = self.packed.len() - self.pool.fixed.len();
                exhaustive::search(&self.pool, &*self.objective, slots, watch)?.ok_or_else(none)?
            }
            Method::Genetic => self.bred(seed, watch)?,
            Method::Refined => {
                let exchanged = self.exchanged(&*self.objective, seed, watch)?;
                let best = exchanged.or_better(Some(self.bred(seed, watch)?));
                return self.judged(method, refine::refine(self, &best.selection, watch)?);
            }
        };
        self.designed(method, &found.selection)
    }

    fn bred(&self, seed: u64, watch: Watch) -> Result<super::Found, Cancelled> {
        genetic::search(&self.pool, &*self.objective, &self.packed, seed, watch)
    }
}
