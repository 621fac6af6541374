//! `[estimator]`

use serde::Deserialize;

use palpate_estimators::centroid::Centroid;
use palpate_estimators::closed_form::ClosedForm;
use palpate_estimators::digit::{DigitEstimator, DigitTheory};
use palpate_estimators::estimator::{Auto, Estimator};
use palpate_estimators::gaussian_process::GaussianProcessEstimator;
use palpate_estimators::influence::{Influence, InfluenceSource, Structure};
use palpate_estimators::neighbours::Neighbours;
use palpate_estimators::network::{
    Activation, BackPropagation, InputScale, LevenbergMarquardt, Network, OutputCoding, Precision,
    PresentationOrder,
};
use palpate_estimators::status::FalseAlarmRate;
use palpate_mechanics::sensing::Layout;

use crate::document::At;
use crate::error::{RigError, RigProblem};
use crate::values::{AboveZero, Count, FalseAlarms, Force, Fraction, Number, Positive, RawQuantity};

/// The method that locates.
#[derive(Clone, Debug, Deserialize)]
#[serde(rename = "by kind or network", rename_all = "kebab-case")]
pub(crate) enum EstimatorKeys {
    /// The founding paper's network.
    Network(NetworkKeys),
    /// Networks trained by Levenberg–Marquardt with Bayesian regularisation.
    NetworkLm,
    /// Influence functions, inverted.
    Influence(InfluenceKeys),
    /// Gaussian-process regression of the position.
    GaussianProcess,
    /// The beam's own equations.
    ClosedForm(ClosedFormKeys),
    /// The bending finger's own equations.
    Digit(DigitKeys),
    /// Nearest neighbours.
    Neighbours,
    /// The calibrated centroid of array sensors.
    Centroid,
    /// Choice among the others at held-out positions.
    Auto(AutoKeys),
}

/// A feed-forward network and its training by back-propagation; the defaults are those of the founding paper.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct NetworkKeys {
    /// Nodes of each hidden layer, input side first; [10] by default.
    pub hidden: Option<At<Vec<Count<1, 1000>>>>,
    /// Activation of the hidden layers; `logistic` by default.
    pub hidden_activation: Option<Activation>,
    /// Activation of the output layer; `logistic` by default.
    pub output_activation: Option<Activation>,
    /// Whether every node has a bias; `true` by default.
    pub biases: Option<bool>,
    /// Coding of the output; `normalized` by default.
    pub output: Option<OutputCoding>,
    /// Scaling of readings to inputs: `full-scale`, `standardized`, or a reading to divide by; `full-scale` by default.
    pub input_scale: Option<At<RawQuantity>>,
    /// The step along the gradient; 0.7 by default.
    pub learning_rate: Option<Positive<Number>>,
    /// The share of the previous step that is repeated; 0.9 by default.
    pub momentum: Option<Fraction>,
    /// Training converges when the sum of squared output errors over an epoch is at most this; 1e-5 by default.
    pub aggregate_error: Option<Positive<Number>>,
    /// Training is capped after this many epochs, and with more than 65,536 rows after 200 million presentations; 1000000 by default.
    pub max_epochs: Option<Count<1, { u32::MAX as i64 }>>,
    /// Order in which patterns are presented; `shuffled` by default.
    pub order: Option<PresentationOrder>,
    /// Weights start uniform within ± this; 0.5 by default.
    pub initial_weights: Option<Positive<Number>>,
}

/// Inversion of the influence functions, which give the reading of each sensor as a function of the contact.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct InfluenceKeys {
    /// Source of the influence functions; `corrected` by default.
    pub source: Option<InfluenceSource>,
    /// The most contacts that may touch at once, more than one only on a line with a model; 1 by default.
    pub contacts: Option<Count<1, 3>>,
    /// Standard deviation of the contact's force about that of `[contact]`; 0 by default.
    pub force_sd: Option<At<Positive<Force>>>,
    /// Structure of the readings of a `measured` surface.
    #[serde(default)]
    pub structure: Structure,
    /// Share of untouched readings that are estimated as a contact; 0.1 % by default.
    pub false_alarm_rate: Option<FalseAlarms>,
}

/// Inversion of the beam's own equations.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct ClosedFormKeys {
    /// Share of untouched readings that are estimated as a contact; 0.1 % by default.
    pub false_alarm_rate: Option<FalseAlarms>,
}

/// The elastica of the finger, or its linearisation.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct DigitKeys {
    /// The theory of bending.
    #[serde(default)]
    pub theory: DigitTheory,
    /// Share of untouched readings that are estimated as a contact; 0.1 % by default.
    pub false_alarm_rate: Option<FalseAlarms>,
}

/// Choice of the estimator with the smallest errors and intervals at held-out positions.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct AutoKeys {
    /// Kinds of the candidates; all that suit the surface by default.
    pub only: Option<Vec<At<String>>>,
}

impl AutoKeys {
    fn build(&self) -> Result<Auto, RigError> {
        let only = self.only.iter().flatten().map(|kind| match kind.as_str() {
            "auto" => Err(kind.place.refuse("the kind of an estimator other than `auto`".to_owned())),
            known if Estimator::KINDS.contains(&known) => Ok(known.to_owned()),
            _ => Err(kind.place.refuse(format!("one of {}", kinds()))),
        });
        Ok(Auto { only: only.collect::<Result<_, _>>()? })
    }
}

fn kinds() -> String {
    let kinds: Vec<String> =
        Estimator::KINDS.iter().filter(|kind| **kind != "auto").map(|kind| format!("`{kind}`")).collect();
    kinds.join(", ")
}

fn rate(key: Option<FalseAlarms>) -> FalseAlarmRate {
    key.and_then(|rate| FalseAlarmRate::new(rate.si).ok()).unwrap_or_default()
}

impl EstimatorKeys {
    pub fn build(&self, layout: &Layout, force_n: Option<f64>) -> Result<Estimator, RigError> {
        Ok(match self {
            Self::Network(keys) => Estimator::Network(keys.build(layout)?),
            Self::NetworkLm => Estimator::NetworkLm(LevenbergMarquardt::default()),
            Self::Influence(keys) => Estimator::Influence(keys.build(force_n)?),
            Self::GaussianProcess => Estimator::GaussianProcess(GaussianProcessEstimator::default()),
            Self::ClosedForm(keys) => {
                Estimator::ClosedForm(ClosedForm { false_alarm_rate: rate(keys.false_alarm_rate) })
            }
            Self::Digit(keys) => Estimator::Digit(DigitEstimator {
                theory: keys.theory,
                false_alarm_rate: rate(keys.false_alarm_rate),
            }),
            Self::Neighbours => Estimator::Neighbours(Neighbours::default()),
            Self::Centroid => Estimator::Centroid(Centroid),
            Self::Auto(keys) => Estimator::Auto(keys.build()?),
        })
    }
}

impl NetworkKeys {
    fn build(&self, layout: &Layout) -> Result<Network, RigError> {
        const MOST_LAYERS: usize = 16;
        let default = Network::default();
        let hidden = match &self.hidden {
            Some(layers) if layers.len() > MOST_LAYERS => {
                return Err(layers.place.refuse(format!("a list of at most {MOST_LAYERS}")));
            }
            Some(layers) => layers.iter().map(|nodes| nodes.get()).collect(),
            None => default.hidden,
        };
        let number = |key: Option<Positive<Number>>, default| key.map_or(default, |number| number.si);
        let training = default.training;
        Ok(Network {
            hidden,
            hidden_activation: self.hidden_activation.unwrap_or(default.hidden_activation),
            output_activation: self.output_activation.unwrap_or(default.output_activation),
            biases: self.biases.unwrap_or(default.biases),
            output: self.output.unwrap_or(default.output),
            input_scale: match &self.input_scale {
                Some(scale) => input_scale(scale, layout)?,
                None => default.input_scale,
            },
            training: BackPropagation {
                learning_rate: number(self.learning_rate, training.learning_rate),
                momentum: self.momentum.map_or(training.momentum, |momentum| momentum.si),
                aggregate_error: number(self.aggregate_error, training.aggregate_error),
                max_epochs: self.max_epochs.map_or(training.max_epochs, |epochs| epochs.get() as u32),
                order: self.order.unwrap_or(training.order),
                initial_weights: number(self.initial_weights, training.initial_weights),
            },
            precision: Precision::default(),
        })
    }
}

fn input_scale(scale: &At<RawQuantity>, layout: &Layout) -> Result<InputScale, RigError> {
    if let RawQuantity::Text(text) = &**scale {
        match text.as_str() {
            "full-scale" => return Ok(InputScale::FullScale),
            "standardized" => return Ok(InputScale::Standardized),
            word if word.trim_start().starts_with(|c: char| c.is_ascii_digit() || "+-.".contains(c)) => {}
            word => {
                let (key, known) = (scale.place.key().to_owned(), vec!["full-scale", "standardized"]);
                return Err(
                    RigProblem::UnknownWord { key, word: word.to_owned(), known }.at_place(&scale.place)
                );
            }
        }
    }
    let kinds = layout.kinds();
    let Some(first) = kinds.first() else { return Ok(InputScale::FullScale) };
    if let Some(second) = kinds.iter().find(|kind| kind.dimension() != first.dimension()) {
        let bound = format!("a word: one reading cannot scale both {first} and {second} sensors");
        return Err(scale.place.refuse(bound));
    }
    scale.si::<AboveZero>(first.dimension()).map(InputScale::DivideBy)
}

impl InfluenceKeys {
    fn build(&self, force_n: Option<f64>) -> Result<Influence, RigError> {
        let default = Influence::default();
        if let (Some(force_sd), None) = (&self.force_sd, force_n) {
            let with = "an unknown force; give [contact] `force`, about which it spreads";
            return Err(force_sd.place.unused(with));
        }
        Ok(Influence {
            source: self.source.unwrap_or(default.source),
            contacts: self.contacts.map_or(default.contacts, Count::get),
            force_sd_n: self.force_sd.as_ref().map(|force_sd| force_sd.si),
            structure: self.structure,
            false_alarm_rate: rate(self.false_alarm_rate),
        })
    }
}
