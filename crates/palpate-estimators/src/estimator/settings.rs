//! An estimator's settings in words, so that a report can list those of any method.

use super::Estimator;
use crate::digit::{DigitEstimator, DigitTheory};
use crate::influence::{Influence, InfluenceSource};
use crate::network::{
    Activation, BackPropagation, InputScale, LevenbergMarquardt, Network, OutputCoding, PresentationOrder,
};
use palpate_mechanics::units::format_count;

/// One setting of an estimator.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Setting {
    /// Its key in a rig's `[estimator]`, or a name of its own where a rig cannot change it.
    pub key: &'static str,
    /// What it is, in words.
    pub name: &'static str,
    /// Its value in words, with its unit.
    pub value: String,
}

impl Estimator {
    /// Every setting of the estimator, in words.
    pub fn settings(&self) -> Vec<Setting> {
        match self {
            Self::Network(config) => network(config),
            Self::Influence(config) => influence(*config),
            Self::Digit(config) => digit(*config),
            Self::NetworkLm(config) => levenberg_marquardt(config),
            Self::Neighbours(config) => vec![Setting {
                key: "most_neighbours",
                name: "neighbours tried, at most",
                value: config.most.to_string(),
            }],
            // They have nothing to set.
            Self::GaussianProcess(_) | Self::ClosedForm(_) | Self::Centroid(_) | Self::Auto => Vec::new(),
        }
    }
}

fn digit(config: DigitEstimator) -> Vec<Setting> {
    let theory = match config.theory {
        DigitTheory::Exact => "exact: the finger bends as far as the force bends it",
        DigitTheory::Linear => "linear: strain is force times lever",
    };
    vec![Setting { key: "theory", name: "theory of bending", value: theory.to_owned() }]
}

fn levenberg_marquardt(config: &LevenbergMarquardt) -> Vec<Setting> {
    let hidden: Vec<String> = config.hidden.iter().map(usize::to_string).collect();
    vec![
        Setting { key: "hidden", name: "nodes in the hidden layers", value: hidden.join(", ") },
        Setting { key: "ensemble", name: "networks in the ensemble", value: config.ensemble.to_string() },
        Setting {
            key: "max_iterations",
            name: "iterations, at most",
            value: format_count(u64::from(config.max_iterations)),
        },
    ]
}

fn influence(config: Influence) -> Vec<Setting> {
    let from = match config.from {
        InfluenceSource::Recording => "the recording alone",
        InfluenceSource::Mechanics => "the mechanics alone",
        InfluenceSource::Corrected => "the mechanics, corrected by the recording",
    };
    let force = match config.force_sd_n {
        Some(sd_n) => format!("about the bench's, ± {sd_n} N (1 σ)"),
        None => "as the bench says: known, or unknown".to_owned(),
    };
    vec![
        Setting { key: "from", name: "influence functions from", value: from.to_owned() },
        Setting { key: "contacts", name: "contacts at once, at most", value: config.contacts.to_string() },
        Setting { key: "force_sd", name: "contact force", value: force },
    ]
}

fn network(config: &Network) -> Vec<Setting> {
    let setting = |key, name, value| Setting { key, name, value };
    let BackPropagation { learning_rate, momentum, aggregate_error, max_epochs, order, initial_weights } =
        config.training;
    let hidden: Vec<String> = config.hidden.iter().map(usize::to_string).collect();
    vec![
        setting(
            "hidden",
            "nodes in the hidden layers",
            if hidden.is_empty() { "no hidden layer".to_owned() } else { hidden.join(", ") },
        ),
        setting("hidden_activation", "activation, hidden", activation(config.hidden_activation).to_owned()),
        setting("output_activation", "activation, output", activation(config.output_activation).to_owned()),
        setting("biases", "biases", if config.biases { "every node has one" } else { "none" }.to_owned()),
        setting("output", "output", output(config.output).to_owned()),
        setting("input_scale", "input scale", input_scale(config.input_scale)),
        setting("learning_rate", "learning rate", learning_rate.to_string()),
        setting("momentum", "momentum", momentum.to_string()),
        setting("weight_update", "weight update", "after every pattern".to_owned()),
        setting("order", "presentation order", presentation_order(order).to_owned()),
        setting("initial_weights", "initial weights", format!("uniform within ±{initial_weights}")),
        setting("aggregate_error", "training stops", stop(aggregate_error)),
        setting("max_epochs", "most iterations", format!("{} epochs", format_count(max_epochs.into()))),
    ]
}

fn activation(activation: Activation) -> &'static str {
    match activation {
        Activation::Logistic => "logistic sigmoid",
        Activation::Tanh => "hyperbolic tangent",
        Activation::Linear => "linear",
    }
}

fn output(coding: OutputCoding) -> &'static str {
    match coding {
        OutputCoding::Position => "the position in metres",
        OutputCoding::Normalized => "the position divided by the length",
    }
}

fn input_scale(scale: InputScale) -> String {
    match scale {
        InputScale::FullScale => {
            "divided by the largest reading that the contact force can cause (full scale)".to_owned()
        }
        InputScale::Standardized => {
            "each channel shifted to mean 0 and divided by its standard deviation".to_owned()
        }
        InputScale::DivideBy(divisor) => format!("divided by {divisor} in the sensors' SI unit"),
    }
}

fn presentation_order(order: PresentationOrder) -> &'static str {
    match order {
        PresentationOrder::Shuffled => "a fresh random order every epoch",
        PresentationOrder::Fixed => "the same order every epoch",
    }
}

fn stop(aggregate_error: f64) -> String {
    format!("when the squared output errors of one epoch sum to at most {aggregate_error:e}")
}
