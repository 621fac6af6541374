//! `--tare`: correction of readings for offsets that have changed since the calibration.

use crate::failure::{Failure, UserError};
use crate::input::{self, RecordingFiles};
use crate::lines::{Lines, Readings, Records};
use crate::progress::Observer;
use crate::remark::remark;
use palpate_estimators::estimator::{Estimate, Locator, Status, Tare, TareError, subtract_drift};
use palpate_estimators::evaluation::Split;
use palpate_estimators::fit::FitTask;
use palpate_estimators::influence::Influence;
use palpate_estimators::recording::{Recording, Zero};
use palpate_estimators::setup::Setup;
use palpate_mechanics::units::{Quantity, format_count};
use std::path::{Path, PathBuf};
use std::str::FromStr;

/// Source of the baseline.
#[derive(clap::Args)]
pub struct TareOption {
    /// Tare the readings: correct offsets that have changed since the calibration
    ///
    /// The baseline is the mean of the first N readings, of those of a time such as "2 s", or of a FILE of untouched readings. `auto` detects untouched
    /// readings and updates the baseline with each; `last` takes the latest one. `N,auto` and "2 s,auto" begin with the first readings and continue so.
    #[arg(long, value_name = "N|TIME|FILE|auto|last|N,auto")]
    pub tare: Option<Source>,
}

impl TareOption {
    pub fn path(&self) -> Option<&Path> {
        match &self.tare {
            Some(Source::File(path)) => Some(path),
            _ => None,
        }
    }

    /// Returns the tare in use; `last` is the default if the calibration has `zero = "last"` and
    /// untouched readings can be detected.
    pub fn in_use(&self, locator: &Locator) -> Self {
        let is_last = locator.setup.recording_columns().zero == Zero::Last;
        let default = || Source::Last { first: Start::NONE };
        let by_locator = (is_last && locator.false_alarm_rate().is_some()).then(default);
        Self { tare: self.tare.clone().or(by_locator) }
    }

    pub fn in_words(&self) -> &'static str {
        if self.tare.is_some() { ", tared" } else { "" }
    }

    pub fn check_recorded(&self, files: &RecordingFiles) -> Result<(), Failure> {
        if self.tare.is_some() && files.data.is_none() {
            let user_error = UserError::new("--tare needs a recording: simulated calibrations start at zero");
            return Err(user_error.help("--data names a recording to evaluate on").into());
        }
        Ok(())
    }

    pub fn check_drifts(&self, files: &RecordingFiles, setup: &Setup) -> Result<(), Failure> {
        if self.tare.is_some() && files.data.is_none() && setup.imperfections().is_none() {
            let user_error = UserError::new("--tare: simulated readings do not drift");
            return Err(user_error.help("--data names a recording to evaluate on").into());
        }
        Ok(())
    }
}

/// Source of untouched readings.
#[derive(Clone, Debug, PartialEq)]
pub enum Source {
    First(Start),
    File(PathBuf),
    /// The first readings, and later ones that the locator detects as untouched.
    Auto {
        first: Start,
    },
    /// The first readings, and then the latest one that the locator detects as untouched.
    Last {
        first: Start,
    },
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Start {
    Readings(u64),
    /// Time from the start, in seconds.
    Seconds(f64),
}

impl Start {
    const NONE: Self = Self::Readings(0);
}

impl std::fmt::Display for Start {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Readings(count) => write!(f, "{count}"),
            Self::Seconds(seconds) => write!(f, "{seconds} s"),
        }
    }
}

impl FromStr for Start {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if let Ok(count) = text.parse() {
            return if count > 0 {
                Ok(Self::Readings(count))
            } else {
                Err("it must be at least 1 reading".to_owned())
            };
        }
        input::time(text).map(Self::Seconds).map_err(|_| {
            format!("`{text}` must be a whole number of readings, at least 1, or a time, as in `20` or `2 s`")
        })
    }
}

impl Source {
    fn first(&self) -> Start {
        match self {
            Self::First(first) | Self::Auto { first } | Self::Last { first } => *first,
            Self::File(_) => Start::NONE,
        }
    }

    fn updated_label(&self) -> Option<&'static str> {
        match self {
            Self::Auto { .. } => Some("auto"),
            Self::Last { .. } => Some("last"),
            Self::First(_) | Self::File(_) => None,
        }
    }
}

impl FromStr for Source {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if let Some((first, followed @ ("auto" | "last"))) = text.rsplit_once(',') {
            let first = first.trim().parse()?;
            return Ok(if followed == "auto" { Self::Auto { first } } else { Self::Last { first } });
        }
        let is_number = text.contains(|c: char| c.is_ascii_digit()) && text.parse::<f64>().is_ok();
        match text {
            "auto" => Ok(Self::Auto { first: Start::NONE }),
            "last" => Ok(Self::Last { first: Start::NONE }),
            "-" => Err("untouched readings cannot come from stdin; name a file".to_owned()),
            _ if is_number => match text.parse() {
                Ok(count) if count > 0 => Ok(Self::First(Start::Readings(count))),
                _ => Err(format!(
                    "`{text}` must be a whole number of readings, at least 1; a file of that name is `./{text}`"
                )),
            },
            _ => match input::time(text) {
                Ok(seconds) => Ok(Self::First(Start::Seconds(seconds))),
                Err(_) => Ok(Self::File(text.into())),
            },
        }
    }
}

#[derive(Clone, Debug, PartialEq)]
pub enum TareOutcome {
    Baseline,
    Tared,
    /// A tared reading, with its estimate by the tare that updates the baseline.
    Located(Box<Estimate>),
}

#[derive(Debug, thiserror::Error)]
pub enum TakeError {
    #[error(transparent)]
    Tare(#[from] TareError),
    #[error(
        "the reading has no time, and --tare takes those of the first {0} s: name the column as `time` in [recording], or give a number of readings"
    )]
    NoTime(f64),
}

pub struct Taring<'a> {
    locator: &'a Locator,
    source: Source,
    tare: Tare<Vec<f64>>,
    /// True until the end of the readings that are known to be untouched.
    is_beginning: bool,
    begun_s: Option<f64>,
    first: u64,
    /// Number of readings in an unchanging baseline, or of detected untouched readings.
    count: u64,
    /// Number of readings that are `outside_model` with an updated baseline.
    unexplained: u64,
    /// First readings of the baseline, to check that they are untouched.
    first_readings: Vec<Vec<f64>>,
    tared: Vec<f64>,
}

/// Largest number of checked baseline readings, and largest share of them that may appear touched.
const MOST_KEPT: usize = 1000;
const MOST_TOUCHED: f64 = 0.05;

impl<'a> Taring<'a> {
    /// Reads the requested tare and its FILE; `None` without one.
    pub fn new(option: &TareOption, locator: &'a Locator, no_header: bool) -> Result<Option<Self>, Failure> {
        let Some(source) = option.tare.clone() else { return Ok(None) };
        let tare = locator.tare().map_err(|error| {
            UserError::new(format!("--tare: {error}")).help(
                "add rows of force 0 to the recording and fit again, or fit `kind = \"influence\"` to a recording with forces",
            )
        })?;
        let tared = tare.calibration_baseline().to_vec();
        let mut taring = Self {
            locator,
            source: source.clone(),
            tare,
            is_beginning: source.first() != Start::NONE,
            begun_s: None,
            first: 0,
            count: 0,
            unexplained: 0,
            first_readings: Vec::new(),
            tared,
        };
        match source {
            Source::File(path) => taring.read(&path, no_header)?,
            Source::First(_) => {}
            Source::Auto { .. } | Source::Last { .. } if locator.false_alarm_rate().is_none() => {
                let message = format!(
                    "--tare {}: a locator of kind `{}` cannot distinguish untouched readings from contacts",
                    source.updated_label().unwrap_or_default(),
                    locator.kind()
                );
                return Err(UserError::new(message)
                    .help("--tare N uses the first N readings as untouched, --tare FILE those of a file")
                    .into());
            }
            Source::Auto { .. } => {}
            Source::Last { .. } => taring.tare = taring.tare.with_last_zero(),
        }
        Ok(Some(taring))
    }

    fn read(&mut self, path: &Path, no_header: bool) -> Result<(), Failure> {
        let mut readings = Readings::new(Lines::open(path, Records::None)?, &self.locator.setup, no_header);
        while let Some(reading) = readings.next()? {
            self.add(&reading).map_err(|error| UserError::for_path(path, error))?;
        }
        if !readings.lines.is_whole() {
            let user_error =
                UserError::for_path(path, "not every line is a reading, so the tare would be wrong");
            return Err(user_error.help("correct the lines above, or remove them").into());
        }
        if self.count == 0 {
            let user_error = UserError::for_path(path, "it contains no untouched reading");
            return Err(user_error
                .help("it must begin with a header; --no-header reads values alone")
                .into());
        }
        self.report_baseline();
        Ok(())
    }

    pub fn take(&mut self, reading: &mut [f64], time_s: Option<f64>) -> Result<TareOutcome, TakeError> {
        if let Some(time_s) = time_s {
            self.tare.note_time(time_s);
        }
        if self.is_beginning && self.is_of_beginning(time_s)? {
            self.add(reading)?;
            self.first = self.count;
            if self.source.first() == Start::Readings(self.count) {
                self.end_beginning();
            }
            return Ok(TareOutcome::Baseline);
        }
        if self.is_beginning {
            self.end_beginning();
        }
        let taken = match self.source {
            Source::First(_) | Source::File(_) => {
                self.tare.apply(reading, &mut self.tared)?;
                TareOutcome::Tared
            }
            Source::Auto { .. } | Source::Last { .. } => {
                let estimate = self.locator.locate_following(&mut self.tare, reading, &mut self.tared)?;
                self.count += u64::from(estimate.status == Status::NoContact);
                self.unexplained += u64::from(estimate.status == Status::OutsideModel);
                TareOutcome::Located(Box::new(estimate))
            }
        };
        reading.copy_from_slice(&self.tared);
        Ok(taken)
    }

    fn is_of_beginning(&mut self, time_s: Option<f64>) -> Result<bool, TakeError> {
        match self.source.first() {
            Start::Readings(first) => Ok(self.count < first),
            Start::Seconds(seconds) => {
                let time_s = time_s.ok_or(TakeError::NoTime(seconds))?;
                let begun_s = *self.begun_s.get_or_insert(time_s);
                Ok(time_s - begun_s < seconds)
            }
        }
    }

    fn end_beginning(&mut self) {
        self.is_beginning = false;
        self.report_baseline();
    }

    fn add(&mut self, reading: &[f64]) -> Result<(), TareError> {
        self.tare.add_untouched(reading)?;
        self.count += 1;
        if self.first_readings.len() < MOST_KEPT {
            self.first_readings.push(reading.to_vec());
        }
        Ok(())
    }

    /// Reports the baseline, and warns if its readings vary like touched ones.
    fn report_baseline(&mut self) {
        self.print_baseline_change();
        if self.locator.false_alarm_rate().is_none() {
            return;
        }
        let kept = std::mem::take(&mut self.first_readings);
        let mut touched = 0;
        for reading in &kept {
            let tared = self.tare.apply(reading, &mut self.tared);
            let estimate = tared.ok().and_then(|()| self.locator.locate(&self.tared).ok());
            touched += usize::from(estimate.is_none_or(|estimate| estimate.status != Status::NoContact));
        }
        if touched as f64 > MOST_TOUCHED * kept.len() as f64 {
            remark!(
                "palpate: warning: {touched} of {} readings of the tare are not within the noise of their mean: the surface was touched, or it drifts",
                kept.len()
            );
        }
    }

    fn print_baseline_change(&self) {
        let moved = self
            .tare
            .baseline()
            .iter()
            .zip(self.tare.calibration_baseline())
            .map(|(today, learnt)| today - learnt);
        let most = moved.enumerate().max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()));
        let Some((channel, value)) = most else { return };
        let sensor = &self.locator.setup.layout().sensors()[channel];
        let from = match self.source {
            Source::Last { .. } if self.count > self.first => "the latest untouched reading".to_owned(),
            Source::Auto { .. } if self.count > self.first => {
                format!("{} untouched readings that were found", format_count(self.count - self.first))
            }
            _ => format!("the mean of {} readings", self.count),
        };
        let moved = Quantity { value, dimension: sensor.kind.dimension() };
        remark!("palpate: tare from {from}; {} has moved most, by {moved}", sensor.name);
    }

    /// Reports an updated baseline, and warns of too few untouched readings.
    fn print_updated_baseline(&self, followed: &str, source: &str) {
        if self.count > 0 {
            self.print_baseline_change();
        }
        let settled = u64::from(Tare::<Vec<f64>>::SETTLED);
        if self.count < settled {
            let found = if self.count == 0 { "no".to_owned() } else { format!("only {}", self.count) };
            remark!(
                "palpate: warning: --tare {followed} found {found} untouched reading{} in {source}, so the baseline may be that of a contact; leave the surface untouched for a moment, or use --tare N or --tare FILE",
                if self.count > 1 { "s" } else { "" }
            );
        } else if !self.tare.is_confirmed() && self.unexplained >= settled {
            remark!(
                "palpate: warning: --tare {followed}: {} readings of {source} differ from the baseline without matching a contact, and no contact has started \
                 and ended: the surface may have been touched at the start. --tare N or --tare FILE uses readings that are known to be untouched",
                format_count(self.unexplained)
            );
        }
    }

    /// Ends the readings of `source`.
    ///
    /// # Errors
    /// A failure if the baseline needs more readings.
    pub fn finish(&self, source: &str) -> Result<(), Failure> {
        if self.is_beginning {
            let needed = self.source.first();
            let message = format!(
                "--tare {needed}: {source} contains {} readings; the first {needed} must be untouched",
                self.count
            );
            return Err(UserError::new(message).help("give fewer, or record longer").into());
        }
        if let Some(followed) = self.source.updated_label() {
            self.print_updated_baseline(followed, source);
        }
        Ok(())
    }
}

/// Corrects held-out readings for the drift in the training presses of their folds. Without a
/// requested tare, a warning reports the drift.
pub fn tare_splits(
    option: &TareOption,
    setup: &Setup,
    recording: &Recording,
    splits: &mut [Split],
) -> Result<(), Failure> {
    match option.tare {
        Some(Source::Auto { first: Start::NONE }) => {}
        Some(_) => {
            let message = "--tare accepts only `auto` here; N, a time, a FILE and `last` need a locator: a rig is evaluated by folds of one recording";
            return Err(UserError::new(message)
                .help("--tare auto subtracts the drift that the presses show")
                .into());
        }
        None if recording.rows.len() > MOST_LOOKED_AT => return Ok(()),
        None => {
            let course = Observer::of_rounds(0)
                .watch(|watch| {
                    Influence::default().offset_course(FitTask::new(setup, recording).watch(watch), recording)
                })
                .map_err(|error| Failure::from_error(&error))?;
            if let Some(course) = course {
                remark!(
                    "warning: {}: {}, and so do the held-out readings; `--tare auto` subtracts it",
                    recording.provenance.source,
                    largest_drift_text(setup, &course.spans())
                );
            }
            return Ok(());
        }
    }
    let spans = Observer::of_rounds(0)
        .watch(|watch| subtract_drift(setup, splits, watch))
        .map_err(|error| Failure::from_error(&error))?;
    match spans {
        Some(spans) => print_drift(setup, &spans),
        None => remark!("palpate: the presses show no drift; readings are evaluated unchanged"),
    }
    Ok(())
}

pub fn print_drift(setup: &Setup, spans: &[f64]) {
    remark!("palpate: {}; it is subtracted from held-out readings", largest_drift_text(setup, spans));
}

/// Largest number of rows for which a warning is computed.
const MOST_LOOKED_AT: usize = 300;

fn largest_drift_text(setup: &Setup, spans: &[f64]) -> String {
    let most = spans.iter().enumerate().max_by(|a, b| a.1.total_cmp(b.1));
    let Some((channel, value)) = most else { return "no channel drifts".to_owned() };
    let sensor = &setup.layout().sensors()[channel];
    let moved = Quantity { value: *value, dimension: sensor.kind.dimension() };
    format!("the channels drift during the recording, {} by {moved}", sensor.name)
}

/// Tares the readings of a recording as in `palpate locate`, and omits those of the baseline.
pub fn tared_recording(
    option: &TareOption,
    locator: &Locator,
    mut recording: Recording,
) -> Result<Recording, Failure> {
    let Some(mut taring) = Taring::new(option, locator, false)? else { return Ok(recording) };
    let mut kept = Vec::with_capacity(recording.rows.len());
    for (i, row) in recording.rows.iter_mut().enumerate() {
        if taring.take(&mut row.reading, row.time_s).map_err(UserError::new)? != TareOutcome::Baseline {
            kept.push(i);
        }
    }
    taring.finish(&recording.provenance.source)?;
    Ok(recording.subset(&kept))
}
