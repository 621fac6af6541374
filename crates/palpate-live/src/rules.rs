//! Rules: actions on contacts in bands of position and force, and on events. A rule file is TOML:
//!
//! ```toml
//! [[rule]]
//! name = "hand near the clamp"
//! x = ["0 mm", "50 mm"]          # a band of positions
//! force = ["2 N", "50 N"]        # a band of forces
//! hold = "50 ms"                 # for so long before it acts, and before it can act again
//! topic = "machine/stop"
//! message = "1"
//!
//! [[rule]]
//! name = "unplugged"
//! event = "source_lost"
//! topic = "machine/stop"
//! message = "sensor"
//!
//! [[rule]]
//! event = "touch_down"
//! command = "brake"              # a line to the board that the readings come from
//!
//! [[rule]]
//! force = ["20 N", "1 kN"]
//! alarm = "too hard"             # an event of the session, which the dashboard shows large
//! ```

use crate::event::EventRecord;
use crate::sample::Sample;
use crate::session::Output;
use palpate_core::{ContactEstimate, Status};
use palpate_estimators::estimator::Locator;
use palpate_mechanics::surface::Extent;
use palpate_mechanics::units::{Dimension, Quantity, format_length_mm};
use serde::Deserialize;
use std::ops::Range;
use std::time::Duration;
use toml::Spanned;

/// Rules of a file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Rules(Vec<Rule>);

/// Rule.
#[derive(Clone, Debug, PartialEq)]
pub struct Rule {
    /// Name.
    pub name: String,
    /// Condition.
    pub condition: Condition,
    /// Action.
    pub action: Action,
}

/// Action of a rule.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Action {
    /// Publishes an MQTT message.
    Publish {
        /// Topic.
        topic: String,
        /// Message.
        message: String,
    },
    /// Sends a line to the board.
    Command(String),
    /// Raises an alarm.
    Alarm(String),
}

/// Rules by action.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RulesByAction {
    /// Rules that publish.
    pub publishing: Rules,
    /// Rules that send commands.
    pub commanding: Rules,
    /// Rules that raise alarms.
    pub alarming: Rules,
}

/// Condition of a rule.
#[derive(Clone, Debug, PartialEq)]
pub enum Condition {
    /// Contact within bands.
    Contact {
        /// Band of x in metres.
        x_m: Option<(f64, f64)>,
        /// Band of y in metres.
        y_m: Option<(f64, f64)>,
        /// Band of forces in newtons.
        force_n: Option<(f64, f64)>,
        /// Time within the bands, and outside before a repetition.
        hold: Duration,
    },
    /// Event of this name.
    Event(String),
}

/// Error of a rule file.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{problem}")]
pub struct RuleError {
    /// Problem.
    pub problem: String,
    /// Byte range in the file.
    pub span: Option<Range<usize>>,
}

const EVENTS: [&str; 14] = [
    "source_opened",
    "source_lost",
    "source_ended",
    "gap",
    "clock_set",
    "touch_down",
    "move",
    "lift_off",
    "outside_model",
    "second_contact",
    "channel",
    "tared",
    "trouble",
    "mark",
];
const AWAY: [&str; 2] = ["source_lost", "source_ended"];
const LONGEST_COMMAND: usize = 200;
const LONGEST_ALARM: usize = 200;
const MOST: usize = 1000;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct FileIn {
    #[serde(default)]
    rule: Vec<Spanned<RuleIn>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RuleIn {
    name: Option<Spanned<String>>,
    x: Option<Spanned<[Spanned<String>; 2]>>,
    y: Option<Spanned<[Spanned<String>; 2]>>,
    force: Option<Spanned<[Spanned<String>; 2]>>,
    hold: Option<Spanned<String>>,
    event: Option<Spanned<String>>,
    topic: Option<Spanned<String>>,
    message: Option<Spanned<String>>,
    command: Option<Spanned<String>>,
    alarm: Option<Spanned<String>>,
}

impl RuleError {
    /// Problem with its line.
    pub fn with_line(&self, text: &str) -> String {
        match self.span.as_ref().and_then(|span| text.get(..span.start)) {
            Some(before) => format!("line {}: {}", before.matches('\n').count() + 1, self.problem),
            None => self.problem.clone(),
        }
    }
}

impl Rules {
    /// Parses a rule file for a surface.
    ///
    /// # Errors
    /// The first problem, also a band beyond the surface.
    pub fn from_toml(text: &str, extent: Extent) -> Result<Self, RuleError> {
        let file: FileIn = toml::from_str(text)
            .map_err(|error| RuleError { problem: error.message().to_owned(), span: error.span() })?;
        if file.rule.is_empty() {
            return Err(RuleError { problem: "[[rule]] is missing".to_owned(), span: None });
        }
        if let Some(beyond) = file.rule.get(MOST) {
            return Err(error_at(beyond.span(), format!("there are more than {MOST} rules")));
        }
        let rules = file.rule.into_iter().enumerate().map(|(i, rule)| Rule::read(i + 1, rule, extent));
        rules.collect::<Result<_, _>>().map(Self)
    }

    /// Rules.
    pub fn as_slice(&self) -> &[Rule] {
        &self.0
    }

    /// First rule with a band of forces, for a locator that [estimates the
    /// force](palpate_estimators::estimator::Locator::estimates_force).
    pub fn first_of_force(&self) -> Option<&Rule> {
        let asks = |rule: &&Rule| matches!(rule.condition, Condition::Contact { force_n: Some(_), .. });
        self.0.iter().find(asks)
    }

    /// Sorts the rules by action.
    pub fn by_action(self) -> RulesByAction {
        let mut sorted = RulesByAction::default();
        for rule in self.0 {
            let kind = match rule.action {
                Action::Publish { .. } => &mut sorted.publishing,
                Action::Command(_) => &mut sorted.commanding,
                Action::Alarm(_) => &mut sorted.alarming,
            };
            kind.0.push(rule);
        }
        sorted
    }

    /// Rule file.
    pub fn to_toml(&self) -> String {
        self.0.iter().map(Rule::to_toml).collect::<Vec<_>>().join("\n")
    }

    /// Checks that all rules raise alarms that this locator supports.
    ///
    /// # Errors
    /// Message about the first other rule.
    pub fn check_alarms(&self, locator: &Locator) -> Result<(), String> {
        if let Some(rule) = self.0.iter().find(|rule| !matches!(rule.action, Action::Alarm(_))) {
            return Err(format!(
                "rule `{}` does not raise an alarm; `palpate serve --rules FILE` and `palpate record` take others",
                rule.name
            ));
        }
        match self.first_of_force() {
            Some(rule) if !locator.estimates_force() => {
                Err(format!("rule `{}` requires a `force`, which this locator does not estimate", rule.name))
            }
            _ => Ok(()),
        }
    }
}

impl Rule {
    fn to_toml(&self) -> String {
        let quoted = |text: &str| toml::Value::from(text).to_string();
        let mut lines = vec!["[[rule]]".to_owned(), format!("name = {}", quoted(&self.name))];
        match &self.condition {
            Condition::Event(event) => lines.push(format!("event = {}", quoted(event))),
            Condition::Contact { x_m, y_m, force_n, hold } => {
                let bands = [("x", x_m, 1e3, "mm"), ("y", y_m, 1e3, "mm"), ("force", force_n, 1.0, "N")];
                for (key, band, factor, unit) in bands {
                    let Some((low, high)) = band else { continue };
                    // Twelve digits hide the rounding error of the unit conversion.
                    let rounded = |value: f64| format!("{value:.11e}").parse().unwrap_or(value);
                    let (low, high) = (rounded(low * factor), rounded(high * factor));
                    lines.push(format!("{key} = [\"{low} {unit}\", \"{high} {unit}\"]"));
                }
                if !hold.is_zero() {
                    lines.push(format!("hold = \"{} s\"", hold.as_secs_f64()));
                }
            }
        }
        match &self.action {
            Action::Publish { topic, message } => {
                lines.push(format!("topic = {}", quoted(topic)));
                lines.push(format!("message = {}", quoted(message)));
            }
            Action::Command(line) => lines.push(format!("command = {}", quoted(line))),
            Action::Alarm(text) => lines.push(format!("alarm = {}", quoted(text))),
        }
        lines.join("\n") + "\n"
    }

    fn read(number: usize, given: Spanned<RuleIn>, extent: Extent) -> Result<Self, RuleError> {
        let span = given.span();
        let given = given.into_inner();
        let hold = match &given.hold {
            None => Duration::ZERO,
            Some(hold) => duration(hold)?,
        };
        let x_m = band("x", Dimension::Length, given.x.as_ref())?;
        let y_m = band("y", Dimension::Length, given.y.as_ref())?;
        let force_n = band("force", Dimension::Force, given.force.as_ref())?;
        check_on_surface(&given, x_m, y_m, extent)?;
        let of_contact = [&given.x, &given.y, &given.force].into_iter().flatten().next();
        let event_at = given.event.as_ref().map(Spanned::span);
        let condition = match (given.event, of_contact) {
            (Some(event), Some(_)) => {
                return Err(error_at(
                    event.span(),
                    "`event` does not go with `x`, `y` and `force`".to_owned(),
                ));
            }
            (Some(event), None) => {
                if let Some(hold) = &given.hold {
                    return Err(error_at(hold.span(), "`hold` does not go with `event`".to_owned()));
                }
                if !EVENTS.contains(&event.get_ref().as_str()) {
                    let known = EVENTS.join(", ");
                    return Err(error_at(
                        event.span(),
                        format!("`event` is `{}`; known are {known}", event.get_ref()),
                    ));
                }
                Condition::Event(event.into_inner())
            }
            (None, Some(_)) => Condition::Contact { x_m, y_m, force_n, hold },
            (None, None) => {
                return Err(error_at(
                    span,
                    "the rule has no `x`, `y`, `force` or `event` to act on".to_owned(),
                ));
            }
        };
        let action = match given.alarm {
            None => action(span, given.topic, given.message, given.command)?,
            Some(alarm) => alarm_of(alarm, [given.topic, given.message, given.command])?,
        };
        if let (Condition::Event(event), Action::Command(_), Some(at)) = (&condition, &action, event_at)
            && AWAY.contains(&event.as_str())
        {
            let problem = format!("`command` does not go with `{event}`: the board is not there then");
            return Err(error_at(at, problem));
        }
        Ok(Self {
            name: given.name.map_or_else(|| format!("rule {number}"), Spanned::into_inner),
            condition,
            action,
        })
    }
}

fn action(
    rule: Range<usize>,
    topic: Option<Spanned<String>>,
    message: Option<Spanned<String>>,
    command: Option<Spanned<String>>,
) -> Result<Action, RuleError> {
    match (topic, message, command) {
        (Some(topic), Some(message), None) => {
            let text = topic.get_ref();
            if text.is_empty() || text.len() > 1000 || text.contains(['+', '#', '\0']) {
                let problem = "`topic` must have 1 to 1000 bytes, without + and #".to_owned();
                return Err(error_at(topic.span(), problem));
            }
            Ok(Action::Publish { topic: topic.into_inner(), message: message.into_inner() })
        }
        (None, None, Some(command)) => {
            let text = command.get_ref();
            if text.trim().is_empty() || text.len() > LONGEST_COMMAND || text.contains(char::is_control) {
                let problem = format!(
                    "`command` must be a line of 1 to {LONGEST_COMMAND} bytes, without control characters"
                );
                return Err(error_at(command.span(), problem));
            }
            Ok(Action::Command(command.into_inner()))
        }
        (Some(other), _, Some(_)) | (None, Some(other), Some(_)) => {
            let problem = "a rule has `topic` and `message`, or a `command`; write two rules".to_owned();
            Err(error_at(other.span(), problem))
        }
        (Some(topic), None, None) => Err(error_at(topic.span(), "`topic` needs a `message`".to_owned())),
        (None, Some(message), None) => Err(error_at(message.span(), "`message` needs a `topic`".to_owned())),
        (None, None, None) => Err(error_at(
            rule,
            "the rule has no `topic` and `message`, no `command` and no `alarm`".to_owned(),
        )),
    }
}

fn alarm_of(alarm: Spanned<String>, others: [Option<Spanned<String>>; 3]) -> Result<Action, RuleError> {
    if let Some(other) = others.into_iter().flatten().next() {
        let problem = "a rule has an `alarm`, or `topic` and `message`, or a `command`; write two rules";
        return Err(error_at(other.span(), problem.to_owned()));
    }
    let text = alarm.get_ref();
    let length = text.chars().count();
    if text.trim().is_empty() || length > LONGEST_ALARM || text.contains(char::is_control) {
        let problem = format!(
            "`alarm` has {length} characters; it must be a line of 1 to {LONGEST_ALARM}, without control characters"
        );
        return Err(error_at(alarm.span(), problem));
    }
    Ok(Action::Alarm(alarm.into_inner()))
}

fn error_at(span: Range<usize>, problem: String) -> RuleError {
    RuleError { problem, span: Some(span) }
}

fn quantity(key: &str, dimension: Dimension, text: &Spanned<String>) -> Result<f64, RuleError> {
    let value = Quantity::parse_as(text.get_ref(), dimension);
    value.map_err(|error| error_at(text.span(), format!("`{key}`: {error}")))
}

fn duration(hold: &Spanned<String>) -> Result<Duration, RuleError> {
    let seconds = quantity("hold", Dimension::Time, hold)?;
    if (0.0..=3600.0).contains(&seconds) {
        return Ok(Duration::from_secs_f64(seconds));
    }
    Err(error_at(hold.span(), format!("`hold` is {}; it must be from 0 s to 3600 s", hold.get_ref())))
}

fn band(
    key: &str,
    dimension: Dimension,
    ends: Option<&Spanned<[Spanned<String>; 2]>>,
) -> Result<Option<(f64, f64)>, RuleError> {
    let Some(ends) = ends else { return Ok(None) };
    let [low, high] = ends.get_ref();
    let band = (quantity(key, dimension, low)?, quantity(key, dimension, high)?);
    if band.0 < band.1 {
        return Ok(Some(band));
    }
    let (low, high) = (low.get_ref(), high.get_ref());
    Err(error_at(
        ends.span(),
        format!("`{key}` is from {low} to {high}; the first must be less than the second"),
    ))
}

fn check_on_surface(
    given: &RuleIn,
    x_m: Option<(f64, f64)>,
    y_m: Option<(f64, f64)>,
    extent: Extent,
) -> Result<(), RuleError> {
    let beside = |key: &str, ends: &Option<Spanned<[Spanned<String>; 2]>>, band, most_m: f64| {
        let (Some(ends), Some((low, high))) = (ends, band) else { return Ok(()) };
        if low <= most_m && high >= 0.0 {
            return Ok(());
        }
        let [low, high] = ends.get_ref();
        let (low, high) = (low.get_ref(), high.get_ref());
        let most = format_length_mm(most_m);
        let problem = format!(
            "`{key}` is from {low} to {high}, and the surface from 0 mm to {most}: name a band on it"
        );
        Err(error_at(ends.span(), problem))
    };
    beside("x", &given.x, x_m, extent.length_m())?;
    match (extent.width_m(), &given.y) {
        (Some(width_m), _) => beside("y", &given.y, y_m, width_m),
        (None, Some(y)) => Err(error_at(
            y.span(),
            "`y` does not go with a surface that is a line: contacts differ only by `x`; remove `y`"
                .to_owned(),
        )),
        (None, None) => Ok(()),
    }
}

/// State of the rules during a session.
#[derive(Debug)]
pub struct RuleWatch {
    rules: Rules,
    states: Vec<State>,
}

#[derive(Clone, Copy, Debug, Default)]
struct State {
    acted: bool,
    changed: Option<Duration>,
}

impl RuleWatch {
    /// Initial state.
    pub fn new(rules: Rules) -> Self {
        Self { states: vec![State::default(); rules.0.len()], rules }
    }

    /// Rules.
    pub fn rules(&self) -> &Rules {
        &self.rules
    }

    /// Passes each rule that acts on an output to `act`.
    pub fn add(&mut self, output: &Output, mut act: impl FnMut(&Rule)) {
        for (rule, state) in self.rules.0.iter().zip(&mut self.states) {
            let acts = match (output, &rule.condition) {
                (Output::Sample(sample), condition @ Condition::Contact { hold, .. }) => {
                    state.next(sample.arrived, *hold, condition.is_met(sample))
                }
                (Output::Event(event), Condition::Event(name)) => is_called(event, name),
                _ => false,
            };
            if acts {
                act(rule);
            }
        }
    }
}

impl State {
    fn next(&mut self, now: Duration, hold: Duration, holds: bool) -> bool {
        if holds == self.acted {
            self.changed = None;
            return false;
        }
        let since = *self.changed.get_or_insert(now);
        if now.saturating_sub(since) < hold {
            return false;
        }
        (self.acted, self.changed) = (holds, None);
        holds
    }
}

impl Condition {
    fn is_met(&self, sample: &Sample) -> bool {
        let estimate = &sample.estimate;
        let touches = matches!(estimate.status, Status::Located | Status::Ambiguous);
        touches
            && std::iter::once(&estimate.contact)
                .chain(estimate.further.as_slice())
                .any(|contact| self.has(contact))
    }

    fn has(&self, contact: &ContactEstimate) -> bool {
        let Self::Contact { x_m, y_m, force_n, .. } = self else { return false };
        let within = |band: Option<(f64, f64)>, value: Option<f64>| match (band, value) {
            (None, _) => true,
            // A contact without an estimated force is outside every band of forces.
            (Some(_), None) => false,
            (Some((low, high)), Some(value)) => (low..=high).contains(&value),
        };
        within(*x_m, Some(contact.position.x_m))
            && within(*y_m, Some(contact.position.y_m))
            && within(*force_n, contact.force_n)
    }
}

fn is_called(event: &EventRecord, name: &str) -> bool {
    event.event.name() == name
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate_core::{Estimate, Position};

    fn beam() -> Extent {
        Extent::line(0.4).unwrap()
    }

    const FILE: &str = r#"
        [[rule]]
        name = "near the clamp"
        x = ["0 mm", "50 mm"]
        hold = "20 ms"
        topic = "stop"
        message = "1"

        [[rule]]
        event = "source_lost"
        topic = "stop"
        message = "sensor"
    "#;

    fn sample(ms: u64, x_mm: Option<f64>) -> Output {
        let estimate = match x_mm {
            Some(x_mm) => Estimate::of_position(Position::along(x_mm * 1e-3), Status::Located),
            None => Estimate::of_position(Position::along(0.02), Status::NoContact),
        };
        Output::Sample(Box::new(Sample {
            number: ms,
            unix_ns: 0,
            arrived: Duration::from_millis(ms),
            reading: Vec::new(),
            tared: Vec::new(),
            estimate,
        }))
    }

    #[test]
    fn a_band_acts_once_it_holds_and_again_only_after_it_was_left_for_as_long() {
        let mut watch = RuleWatch::new(Rules::from_toml(FILE, beam()).unwrap());
        let mut acted = Vec::new();
        // The contact bounces at 5 and 43 ms. It is within the band from 10, outside from 50 to 80, within
        // again from 90.
        let course = [
            (0, None),
            (5, Some(30.0)),
            (6, None),
            (10, Some(30.0)),
            (29, Some(31.0)),
            (30, Some(31.0)),
            (43, None),
            (44, Some(30.0)),
            (50, Some(120.0)),
            (71, Some(120.0)),
            (90, Some(30.0)),
            (110, Some(30.0)),
        ];
        for (ms, x_mm) in course {
            watch.add(&sample(ms, x_mm), |rule| acted.push((ms, rule.name.clone())));
        }
        assert_eq!(acted, [(30, "near the clamp".to_owned()), (110, "near the clamp".to_owned())]);
    }

    #[test]
    fn an_event_acts_by_its_name() {
        let mut watch = RuleWatch::new(Rules::from_toml(FILE, beam()).unwrap());
        let mut acted = 0;
        for event in [
            crate::event::Event::SourceEnded,
            crate::event::Event::SourceLost { why: "unplugged".to_owned() },
        ] {
            watch.add(&Output::Event(EventRecord { time_s: 0.0, event }), |rule| {
                acted += 1;
                assert_eq!(
                    rule.action,
                    Action::Publish { topic: "stop".to_owned(), message: "sensor".to_owned() }
                );
            });
        }
        assert_eq!(acted, 1);
    }

    #[test]
    fn rules_as_text_are_read_as_the_same_rules() {
        let text = FILE.to_owned()
            + "[[rule]]\nname = \"a \\\"b\\\"\"\nx = [\"0.1 mm\", \"12.3 mm\"]\nforce = [\"0.3 N\", \"2 kN\"]\nhold = \"50 ms\"\nalarm = \"ö\"\n\
               [[rule]]\nevent = \"mark\"\ncommand = \"led on\"\n";
        let rules = Rules::from_toml(&text, beam()).unwrap();
        assert_eq!(Rules::from_toml(&rules.to_toml(), beam()).unwrap(), rules, "{}", rules.to_toml());
    }

    #[test]
    fn errors_name_the_line() {
        let text = "[[rule]]\nevent = \"tared\"\nalarm = \"\"\n";
        let error = Rules::from_toml(text, beam()).unwrap_err();
        assert!(
            error.with_line(text).starts_with("line 3: `alarm` has 0 characters"),
            "{}",
            error.with_line(text)
        );
    }

    #[test]
    fn errors_are_reported_at_their_place() {
        let cases = [
            (r#"x = ["5 mm", "1 mm"]"#, r#"["5 mm", "1 mm"]"#),
            (r#"x = ["5 N", "1 mm"]"#, r#""5 N""#),
            (r#"event = "touchdown""#, r#""touchdown""#),
            (
                r#"force = ["1 N", "2 N"]
                hold = "-1 s""#,
                r#""-1 s""#,
            ),
            (r#"colour = 3"#, "colour"),
        ];
        for (line, meant) in cases {
            let text = format!("[[rule]]\n{line}\ntopic = \"t\"\nmessage = \"\"\n");
            let error = Rules::from_toml(&text, beam()).unwrap_err();
            assert_eq!(&text[error.span.clone().unwrap()], meant, "{error}");
        }
        assert!(Rules::from_toml("", beam()).is_err());
    }

    #[test]
    fn bands_that_no_contact_is_in_are_refused() {
        let plane = Extent::plane(0.3, 0.2).unwrap();
        for (band, extent, problem) in [
            (r#"x = ["401 mm", "1 m"]"#, beam(), "the surface from 0 mm to 400 mm"),
            (r#"x = ["-2 mm", "-1 mm"]"#, beam(), "from -2 mm to -1 mm"),
            (r#"y = ["0 mm", "5 mm"]"#, beam(), "a line"),
            (r#"x = ["0.31 m", "0.4 m"]"#, plane, "to 300 mm"),
            (r#"y = ["201 mm", "0.4 m"]"#, plane, "to 200 mm"),
        ] {
            let text = format!("[[rule]]\n{band}\ntopic = \"t\"\nmessage = \"\"\n");
            let error = Rules::from_toml(&text, extent).unwrap_err();
            assert!(error.problem.contains(problem), "{error}");
            assert_eq!(&text[error.span.clone().unwrap()], &band[4..], "{error}");
        }
        for (band, extent) in [(r#"x = ["400 mm", "1 m"]"#, beam()), (r#"y = ["-1 mm", "0 mm"]"#, plane)] {
            let text = format!("[[rule]]\n{band}\ntopic = \"t\"\nmessage = \"\"\n");
            Rules::from_toml(&text, extent).unwrap();
        }
    }

    #[test]
    fn a_rule_publishes_or_commands_and_its_mistakes_are_named_at_their_place() {
        let rules = "[[rule]]\nevent = \"mark\"\ncommand = \"led on\"\n".to_owned() + FILE;
        let sorted = Rules::from_toml(&rules, beam()).unwrap().by_action();
        assert_eq!((sorted.publishing.as_slice().len(), sorted.alarming.as_slice().len()), (2, 0));
        assert_eq!(sorted.commanding.as_slice()[0].action, Action::Command("led on".to_owned()));
        let long = format!("command = \"{}\"", "x".repeat(201));
        for (lines, meant) in [
            ("command = \"a\\nb\"", "\"a\\nb\""),
            ("command = \" \"", "\" \""),
            (long.as_str(), &long[10..]),
            ("command = \"a\"\ntopic = \"t\"\nmessage = \"\"", "\"t\""),
            ("command = \"a\"\nmessage = \"m\"", "\"m\""),
            ("topic = \"t\"", "\"t\""),
            ("message = \"m\"", "\"m\""),
            ("topic = \"t/#\"\nmessage = \"m\"", "\"t/#\""),
            ("alarm = \" \"", "\" \""),
            ("alarm = \"a\\u0007\"", "\"a\\u0007\""),
            ("alarm = \"a\"\ncommand = \"c\"", "\"c\""),
        ] {
            let text = format!("[[rule]]\nevent = \"mark\"\n{lines}\n");
            let error = Rules::from_toml(&text, beam()).unwrap_err();
            assert_eq!(&text[error.span.clone().unwrap()], meant, "{error}");
        }
        let text = "[[rule]]\nevent = \"source_lost\"\ncommand = \"a\"\n";
        let error = Rules::from_toml(text, beam()).unwrap_err();
        assert_eq!(&text[error.span.clone().unwrap()], "\"source_lost\"", "{error}");
        assert!(Rules::from_toml("[[rule]]\nevent = \"mark\"\n", beam()).is_err());
    }
}
