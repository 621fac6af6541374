//! Descriptions of rigs and studies, one line per fact.

use palpate_estimators::description;

use crate::rig::Rig;
use crate::study::Study;

impl Rig {
    /// Describes the rig with all settings of the estimator.
    pub fn in_words(&self) -> Vec<String> {
        let mut lines = vec!["a rig".to_owned()];
        lines.extend(description::setup(&self.setup));
        if let Some(training) = &self.training {
            lines.push(format!("training positions: {}", description::training(training)));
        }
        lines.push(format!("estimator: {}", self.estimator.kind()));
        lines.extend(
            self.estimator
                .settings(&self.setup)
                .iter()
                .map(|setting| format!("    {}: {}", setting.name, setting.value)),
        );
        lines
    }
}

impl Study {
    /// Describes the arms and the setup of the first.
    pub fn in_words(&self) -> Vec<String> {
        let mut lines = vec![format!(
            "the study {}: {} arms × {} seeds, judged at {} positions",
            self.name,
            self.arms.len(),
            self.seeds,
            self.evaluation.positions.len()
        )];
        if let Some(arm) = self.arms.first() {
            lines.extend(description::setup(&arm.rig.setup));
        }
        for arm in &self.arms {
            let training = arm.rig.training.as_ref().map_or_else(String::new, description::training);
            let asked = arm.layout.as_ref().map(|layout| format!(", layout {}", layout.method.name()));
            let (kind, asked) = (arm.rig.estimator.kind(), asked.unwrap_or_default());
            lines.push(format!("arm {}: {training}, {kind}{asked}", arm.name));
        }
        lines
    }
}
