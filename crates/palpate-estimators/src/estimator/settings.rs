//! Settings of an estimator in words.

use super::{Auto, Estimator};
use crate::digit::{DigitEstimator, DigitTheory};
use crate::influence::{Influence, InfluenceSource, Structure};
use crate::network::{
    Activation, BackPropagation, InputScale, LevenbergMarquardt, Network, OutputCoding, PresentationOrder,
};
use crate::setup::Setup;
use crate::status::FalseAlarmRate;
use palpate_mechanics::units::format_count;

/// Setting of an estimator.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Setting {
    /// Key in `[estimator]`, or another name.
    pub key: &'static str,
    /// Name in words.
    pub name: &'static str,
    /// Value with its unit.
    pub value: String,
}

impl Setting {
    fn new(key: &'static str, name: &'static str, value: impl Into<String>) -> Self {
        Self { key, name, value: value.into() }
    }
}

impl Estimator {
    /// Returns every setting for a setup.
    pub fn settings(&self, setup: &Setup) -> Vec<Setting> {
        match self {
            Self::Network(config) => network(config),
            Self::Influence(config) if setup.surface().model().is_none() => measured_influence(*config),
            Self::Influence(config) => influence(*config),
            Self::Digit(DigitEstimator { theory, false_alarm_rate }) => {
                let theory = match theory {
                    DigitTheory::Exact => "exact: the finger bends as far as the force bends it",
                    DigitTheory::Linear => "linear: strain is force times lever",
                };
                vec![Setting::new("theory", "theory of bending", theory), false_alarms(*false_alarm_rate)]
            }
            Self::NetworkLm(LevenbergMarquardt { hidden, ensemble, max_iterations }) => vec![
                Setting::new("hidden", "nodes in the hidden layers", nodes(hidden)),
                Setting::new("ensemble", "networks in the ensemble", ensemble.to_string()),
                Setting::new("max_iterations", "iterations, at most", format_count((*max_iterations).into())),
            ],
            Self::Neighbours(config) => {
                vec![Setting::new("most_neighbours", "neighbours tried, at most", config.most.to_string())]
            }
            Self::ClosedForm(config) => vec![false_alarms(config.false_alarm_rate)],
            Self::GaussianProcess(_) | Self::Centroid(_) => Vec::new(),
            Self::Auto(Auto { only }) if only.is_empty() => Vec::new(),
            Self::Auto(Auto { only }) => vec![Setting::new("only", "candidates", only.join(", "))],
        }
    }
}

fn false_alarms(rate: FalseAlarmRate) -> Setting {
    Setting::new("false_alarm_rate", "false-alarm rate", rate.to_string())
}

fn nodes(hidden: &[usize]) -> String {
    hidden.iter().map(usize::to_string).collect::<Vec<_>>().join(", ")
}

fn influence(config: Influence) -> Vec<Setting> {
    let source = match config.source {
        InfluenceSource::Recording => "the recording alone",
        InfluenceSource::Mechanics => "the mechanics alone",
        InfluenceSource::Corrected => "the mechanics, corrected by the recording",
    };
    let force = match config.force_sd_n {
        Some(sd_n) => format!("about the bench's, ± {sd_n} N (1 σ)"),
        None => "known or unknown, as in the setup".to_owned(),
    };
    vec![
        Setting::new("source", "influence functions from", source),
        Setting::new("contacts", "contacts at once, at most", config.contacts.to_string()),
        Setting::new("force_sd", "prior of the force", force),
        false_alarms(config.false_alarm_rate),
    ]
}

fn measured_influence(config: Influence) -> Vec<Setting> {
    let structure = match config.structure {
        Structure::Auto => "chosen at held-out positions; with fewer than 19, by the evidence",
        Structure::ForceLinear => "force-linear",
        Structure::ForceSaturating => "force-saturating",
        Structure::ForceMonotone => "force-monotone",
        Structure::Free => "free",
    };
    vec![
        Setting::new("source", "influence functions from", "the recording alone"),
        Setting::new("structure", "structure of the readings", structure),
        false_alarms(config.false_alarm_rate),
    ]
}

fn network(config: &Network) -> Vec<Setting> {
    let BackPropagation { learning_rate, momentum, aggregate_error, max_epochs, order, initial_weights } =
        config.training;
    let activation = |activation| match activation {
        Activation::Logistic => "logistic sigmoid",
        Activation::Tanh => "hyperbolic tangent",
        Activation::Linear => "linear",
    };
    let output = match config.output {
        OutputCoding::Position => "the position in metres",
        OutputCoding::Normalized => "the position divided by the length",
    };
    let input_scale = match config.input_scale {
        InputScale::FullScale => {
            "divided by the largest reading that the contact force can cause (full scale)".to_owned()
        }
        InputScale::Standardized => {
            "each channel shifted to mean 0 and divided by its standard deviation".to_owned()
        }
        InputScale::DivideBy(divisor) => format!("divided by {divisor} in the sensors' SI unit"),
    };
    let order = match order {
        PresentationOrder::Shuffled => "a fresh random order every epoch",
        PresentationOrder::Fixed => "the same order every epoch",
    };
    let hidden = if config.hidden.is_empty() { "no hidden layer".to_owned() } else { nodes(&config.hidden) };
    let stop = format!("when the squared output errors of one epoch sum to at most {aggregate_error:e}");
    vec![
        Setting::new("hidden", "nodes in the hidden layers", hidden),
        Setting::new("hidden_activation", "activation, hidden", activation(config.hidden_activation)),
        Setting::new("output_activation", "activation, output", activation(config.output_activation)),
        Setting::new("biases", "biases", if config.biases { "every node has one" } else { "none" }),
        Setting::new("output", "output", output),
        Setting::new("input_scale", "input scale", input_scale),
        Setting::new("learning_rate", "learning rate", learning_rate.to_string()),
        Setting::new("momentum", "momentum", momentum.to_string()),
        Setting::new("weight_update", "weight update", "after every pattern"),
        Setting::new("order", "presentation order", order),
        Setting::new("initial_weights", "initial weights", format!("uniform within ±{initial_weights}")),
        Setting::new("aggregate_error", "training stops", stop),
        Setting::new("max_epochs", "most iterations", format!("{} epochs", format_count(max_epochs.into()))),
    ]
}
