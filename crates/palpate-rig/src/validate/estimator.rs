//! `[estimator]`

use toml::Spanned;

use crate::error::{RigError, RigProblem};
use crate::sections::EstimatorSection;
use crate::value::{RawQuantity, choice, count, number, out_of_range, positive};
use palpate_estimators::centroid::CentroidConfig;
use palpate_estimators::closed_form::ClosedFormConfig;
use palpate_estimators::digit::{DigitConfig, DigitTheory};
use palpate_estimators::estimator::EstimatorConfig;
use palpate_estimators::gaussian_process::GaussianProcessConfig;
use palpate_estimators::influence::{InfluenceConfig, InfluenceSource};
use palpate_estimators::neighbours::NeighboursConfig;
use palpate_estimators::network::{
    Activation, BackPropagation, InputScale, LevenbergMarquardtConfig, NetworkConfig, OutputCoding,
    PresentationOrder,
};
use palpate_mechanics::sensing::Layout;
use palpate_mechanics::units::Dimension;

const ACTIVATIONS: [(&str, Activation); 3] =
    [("logistic", Activation::Logistic), ("tanh", Activation::Tanh), ("linear", Activation::Linear)];
const NETWORK_KEYS: [&str; 12] = [
    "hidden",
    "hidden_activation",
    "output_activation",
    "biases",
    "output",
    "input_scale",
    "learning_rate",
    "momentum",
    "aggregate_error",
    "max_epochs",
    "order",
    "initial_weights",
];
const MOST_LAYERS: usize = 16;
const MOST_NODES: usize = 1000;

pub(super) fn validate(
    section: Option<&Spanned<EstimatorSection>>,
    layout: &Layout,
    force_n: Option<f64>,
) -> Result<EstimatorConfig, RigError> {
    let Some(section) = section else { return Ok(EstimatorConfig::default()) };
    let keys = section.get_ref();
    let known: Vec<(&'static str, &'static str)> =
        EstimatorConfig::KINDS.iter().map(|kind| (*kind, *kind)).collect();
    let kind = keys.kind.as_ref().map_or(Ok("network"), |kind| choice("kind", kind, &known))?;
    let (with, of_kind): (_, &[&str]) = match kind {
        "influence" => ("kind = \"influence\"", &["from", "contacts", "force_sd"]),
        "digit" => ("kind = \"digit\"", &["theory"]),
        "network" => ("kind = \"network\"", &NETWORK_KEYS),
        _ => ("a kind other than \"network\", \"influence\" and \"digit\"", &[]),
    };
    if let Some((key, span)) = keys.present().into_iter().find(|(key, _)| !of_kind.contains(key)) {
        return Err(RigProblem::UnusedKey { key, with }.at(span));
    }
    match kind {
        "influence" => influence(keys, force_n).map(EstimatorConfig::Influence),
        "network-lm" => Ok(EstimatorConfig::NetworkLm(LevenbergMarquardtConfig::default())),
        "gaussian-process" => Ok(EstimatorConfig::GaussianProcess(GaussianProcessConfig::default())),
        "closed-form" => Ok(EstimatorConfig::ClosedForm(ClosedFormConfig)),
        "digit" => digit(keys).map(EstimatorConfig::Digit),
        "neighbours" => Ok(EstimatorConfig::Neighbours(NeighboursConfig::default())),
        "centroid" => Ok(EstimatorConfig::Centroid(CentroidConfig)),
        "auto" => Ok(EstimatorConfig::Auto),
        _ => network(keys, layout).map(EstimatorConfig::Network),
    }
}

fn digit(keys: &EstimatorSection) -> Result<DigitConfig, RigError> {
    let theories = [("exact", DigitTheory::Exact), ("linear", DigitTheory::Linear)];
    let theory =
        keys.theory.as_ref().map_or(Ok(DigitTheory::default()), |raw| choice("theory", raw, &theories))?;
    Ok(DigitConfig { theory })
}

fn influence(keys: &EstimatorSection, force_n: Option<f64>) -> Result<InfluenceConfig, RigError> {
    let default = InfluenceConfig::default();
    let sources = [
        ("recording", InfluenceSource::Recording),
        ("mechanics", InfluenceSource::Mechanics),
        ("corrected", InfluenceSource::Corrected),
    ];
    let contacts = keys.contacts.as_ref();
    let force_sd_n =
        keys.force_sd.as_ref().map(|raw| positive("force_sd", raw, Dimension::Force)).transpose()?;
    if let (Some(raw), None) = (&keys.force_sd, force_n) {
        let with = "an unknown force; give [contact] `force`, about which it spreads";
        return Err(RigProblem::UnusedKey { key: "force_sd", with }.at(raw.span()));
    }
    Ok(InfluenceConfig {
        from: keys.from.as_ref().map_or(Ok(default.from), |raw| choice("from", raw, &sources))?,
        contacts: contacts
            .map_or(Ok(default.contacts), |raw| count("contacts", raw, 1..=3, "at least 1 and at most 3"))?,
        force_sd_n,
    })
}

fn network(keys: &EstimatorSection, layout: &Layout) -> Result<NetworkConfig, RigError> {
    let default = NetworkConfig::default();
    let activation = |key, raw: &Option<Spanned<String>>, default| {
        raw.as_ref().map_or(Ok(default), |raw| choice(key, raw, &ACTIVATIONS))
    };
    let codings = [("position", OutputCoding::Position), ("normalized", OutputCoding::Normalized)];
    Ok(NetworkConfig {
        hidden: keys.hidden.as_ref().map_or(Ok(default.hidden), hidden)?,
        hidden_activation: activation(
            "hidden_activation",
            &keys.hidden_activation,
            default.hidden_activation,
        )?,
        output_activation: activation(
            "output_activation",
            &keys.output_activation,
            default.output_activation,
        )?,
        biases: keys.biases.as_ref().map_or(default.biases, |biases| *biases.get_ref()),
        output: keys.output.as_ref().map_or(Ok(default.output), |raw| choice("output", raw, &codings))?,
        input_scale: keys
            .input_scale
            .as_ref()
            .map_or(Ok(default.input_scale), |raw| input_scale(raw, layout))?,
        training: back_propagation(keys)?,
    })
}

fn hidden(raw: &Spanned<Vec<Spanned<i64>>>) -> Result<Vec<usize>, RigError> {
    let layers = raw.get_ref();
    if layers.len() > MOST_LAYERS {
        let value = format!("a list of {}", layers.len());
        return Err(
            RigProblem::OutOfRange { key: "hidden", value, bound: "a list of at most 16" }.at(raw.span())
        );
    }
    layers.iter().map(|nodes| count("hidden", nodes, 1..=MOST_NODES, "at least 1 and at most 1000")).collect()
}

/// "full-scale", "standardized", or a reading in the sensors' own dimension.
fn input_scale(raw: &Spanned<RawQuantity>, layout: &Layout) -> Result<InputScale, RigError> {
    let RawQuantity::Text(text) = raw.get_ref() else { return divide_by(raw, layout) };
    let starts_a_number = |c: char| c.is_ascii_digit() || matches!(c, '+' | '-' | '.');
    if text.trim_start().starts_with(starts_a_number) {
        return divide_by(raw, layout);
    }
    let words = [("full-scale", InputScale::FullScale), ("standardized", InputScale::Standardized)];
    choice("input_scale", &Spanned::new(raw.span(), text.clone()), &words)
}

fn divide_by(raw: &Spanned<RawQuantity>, layout: &Layout) -> Result<InputScale, RigError> {
    let kinds = layout.kinds();
    if let [first, rest @ ..] = kinds.as_slice() {
        if let Some(second) = rest.iter().find(|kind| kind.dimension() != first.dimension()) {
            return Err(RigProblem::MixedKinds { first: *first, second: *second }.at(raw.span()));
        }
        return positive("input_scale", raw, first.dimension()).map(InputScale::DivideBy);
    }
    Ok(InputScale::FullScale)
}

fn back_propagation(keys: &EstimatorSection) -> Result<BackPropagation, RigError> {
    let default = BackPropagation::default();
    let above_zero = |key, raw: &Option<Spanned<f64>>, default| {
        raw.as_ref().map_or(Ok(default), |raw| number(key, raw, |value| value > 0.0, "greater than 0"))
    };
    let momentum = keys.momentum.as_ref().map_or(Ok(default.momentum), |raw| {
        number("momentum", raw, |value| (0.0..1.0).contains(&value), "at least 0 and below 1")
    })?;
    let max_epochs = keys.max_epochs.as_ref().map_or(Ok(default.max_epochs), |raw| {
        match u32::try_from(*raw.get_ref()) {
            Ok(epochs) if epochs > 0 => Ok(epochs),
            _ => Err(out_of_range("max_epochs", raw, "at least 1 and at most 4294967295")),
        }
    })?;
    let orders = [("shuffled", PresentationOrder::Shuffled), ("fixed", PresentationOrder::Fixed)];
    Ok(BackPropagation {
        learning_rate: above_zero("learning_rate", &keys.learning_rate, default.learning_rate)?,
        momentum,
        aggregate_error: above_zero("aggregate_error", &keys.aggregate_error, default.aggregate_error)?,
        max_epochs,
        order: keys.order.as_ref().map_or(Ok(default.order), |raw| choice("order", raw, &orders))?,
        initial_weights: above_zero("initial_weights", &keys.initial_weights, default.initial_weights)?,
    })
}
