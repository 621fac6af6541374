//! One layout, by the method that is asked for.

use crate::sensors::DesignCriterion;

use super::{DesignError, Designed, KeepGoing, Method, SensorProblem, exhaustive, genetic, refine};

impl SensorProblem<'_> {
    /// The layout by one method; a refined one starts from the better of exchange and genetic search. `None` when `keep_going` says no.
    ///
    /// # Errors
    /// As [`SensorProblem::assess`], and [`DesignError::NoLayout`] where the method has none: even layouts of reaction sensors, QR
    /// layouts that constraints leave no room for.
    pub fn by_method(
        &self,
        method: Method,
        seed: u64,
        keep_going: &mut KeepGoing,
    ) -> Result<Option<Designed>, DesignError> {
        let none = || DesignError::NoLayout { method: method.name() };
        let found = match method {
            Method::Even => return self.even()?.ok_or_else(none).map(Some),
            Method::Rig => return self.own(None),
            Method::GreedyExchange => return self.greedy_exchange(seed, keep_going),
            // Then it is what the criterion asks for.
            Method::DOptimal if self.pool.design.criterion == DesignCriterion::DOptimality => {
                self.exchanged(&*self.objective, seed, keep_going)
            }
            Method::DOptimal | Method::PrincipalComponents | Method::QrPivoting => {
                let Some(others) = self.historical(seed, keep_going)? else { return Ok(None) };
                let asked = others.into_iter().find(|designed| designed.method == method);
                return asked.ok_or_else(none).map(Some);
            }
            Method::Exhaustive => {
                let slots = self.packed.len() - self.pool.fixed.len();
                exhaustive::search(&self.pool, &*self.objective, slots, keep_going)
            }
            Method::Genetic => self.bred(seed, keep_going),
            Method::Refined => {
                let Some(exchanged) = self.exchanged(&*self.objective, seed, keep_going) else {
                    return Ok(None);
                };
                let Some(bred) = self.bred(seed, keep_going) else { return Ok(None) };
                let best = exchanged.or_better(Some(bred));
                let refined = refine::refine(self, &best.selection, keep_going);
                return refined.map(|sensors| self.judged(method, sensors)).transpose();
            }
        };
        found.map(|found| self.designed(method, &found.selection)).transpose()
    }

    fn bred(&self, seed: u64, keep_going: &mut KeepGoing) -> Option<super::Found> {
        genetic::search(&self.pool, &*self.objective, &self.packed, seed, keep_going)
    }
}
