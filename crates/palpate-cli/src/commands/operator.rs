//! Questions to the operator of `palpate calibrate`, and displays of presses and checks.

use crate::failure::Failure;
use crate::json::object;
use crate::remark::alert;
use crate::{input, output, progress};
use palpate_estimators::recording::Row;
use palpate_live::calibration::{
    AwaitedStep, Calibration, Check, Note, Press, Statements, deviation_percent, last_deviation_percent,
};
use palpate_live::feed::REPEATED_READINGS;
use palpate_mechanics::contact::Position;
use palpate_mechanics::surface::Extent;
use palpate_mechanics::units::format_length_mm;
use palpate_rig::Rig;
use serde::Serialize;
use std::io::IsTerminal;
use std::sync::mpsc::{Receiver, RecvTimeoutError};
use std::time::Duration;

/// Asks an operator at the terminal for missing statements.
pub fn ask(
    known: Statements,
    rig: &Rig,
    force_n: Option<f64>,
    keys: &Receiver<String>,
) -> Result<Statements, Failure> {
    let mut stated = known;
    if !std::io::stdin().is_terminal() {
        return Ok(stated);
    }
    if stated.placement_sd_m.is_none() {
        alert!("standard deviation between requested and pressed position? as in 2 mm; Enter: unknown");
        stated.placement_sd_m = read_answer(keys, |text| input::length(text).map(Some))?;
    }
    if let Some(force_n) = stated.single_weight_n(rig, force_n) {
        alert!("{}", single_weight(force_n));
        alert!(
            "second weight? as in {} N; `known`: contacts in use have {force_n} N; Enter: go on with one",
            2.0 * force_n
        );
        let parse = |text: &str| match text {
            "known" => Ok(Some(None)),
            text => input::force(text).map(|second_n| Some(Some(second_n))),
        };
        match read_answer(keys, parse)? {
            Some(Some(second_n)) => stated.second_force_n = Some(second_n),
            Some(None) => stated.force_is_known = true,
            None => {}
        }
    }
    Ok(stated)
}

pub fn single_weight(force_n: f64) -> String {
    format!(
        "all presses have {force_n} N, and the force in use is unknown: one weight does not determine how readings grow with the force"
    )
}

/// Returns true if an operator at the terminal requests a check.
pub fn asks_for_check(keys: &Receiver<String>) -> bool {
    if !std::io::stdin().is_terminal() {
        return false;
    }
    alert!("check the locator at five fresh places? y and Enter: yes; Enter: no");
    let parse = |text: &str| match text {
        "y" | "yes" => Ok(Some(())),
        "n" | "no" => Ok(None),
        _ => Err("y or n".to_owned()),
    };
    matches!(read_answer(keys, parse), Ok(Some(())))
}

/// Returns the next valid line; `None` for an empty one or at the end.
fn read_answer<T>(
    keys: &Receiver<String>,
    parse: impl Fn(&str) -> Result<Option<T>, String>,
) -> Result<Option<T>, Failure> {
    const LOOK_EVERY: Duration = Duration::from_millis(50);
    loop {
        match keys.recv_timeout(LOOK_EVERY) {
            Ok(line) if line.trim().is_empty() => return Ok(None),
            Ok(line) => match parse(line.trim()) {
                Ok(parsed) => return Ok(parsed),
                Err(problem) => alert!("{problem}"),
            },
            Err(RecvTimeoutError::Timeout) if progress::interrupted() => {
                return Err(Failure::Interrupted("stopped before the first press".to_owned()));
            }
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => return Ok(None),
        }
    }
}

pub fn list(rows: &[Row], extent: Extent) {
    let touched = rows.iter().enumerate().filter(|(_, row)| row.touches());
    if touched.clone().next().is_none() {
        alert!("no press is recorded yet");
    }
    for (press, (at, row)) in touched.enumerate() {
        let place = place(Press { position: row.position, force_n: row.force_n, depth_m: None }, extent);
        let off = deviation_percent(rows, at).map_or_else(
            || "no other at its place".to_owned(),
            |off| format!("{off:.2} % off the others of its place"),
        );
        alert!("press {}: {place}, {off}", press + 1);
    }
}

pub fn print_check(
    check: Option<&Check>,
    placement_sd_m: Option<f64>,
    extent: Extent,
) -> Result<(), Failure> {
    let Some(check) = check else {
        alert!("no place was checked");
        return Ok(());
    };
    let at = |position: Position| place(Press { position, force_n: None, depth_m: None }, extent);
    for checked in &check.places {
        let covered = match checked.covered {
            Some(true) => ", within the 95 % interval",
            Some(false) => ", outside the 95 % interval",
            None => "",
        };
        let (place, estimate) = (at(checked.position), at(checked.estimate));
        output::print_line(format!(
            "pressed at {place}: located at {estimate}, {} off{covered}",
            format_length_mm(checked.error_m)
        ))?;
    }
    let (median, mean) = (format_length_mm(check.median_m), format_length_mm(check.mean_m));
    let covered = check.covered.map_or_else(String::new, |covered| {
        format!("; {covered} of {} within their 95 % intervals", check.places.len())
    });
    let placement = placement_sd_m.map_or_else(String::new, |sd_m| {
        format!("; it includes your placement of {}", format_length_mm(sd_m))
    });
    output::print_line(format!("error at fresh places: median {median}, mean {mean}{covered}{placement}"))
}

pub fn check_json(check: &Check) -> impl Serialize + use<> {
    let places = check.places.iter().map(|checked| {
        object! {
            "x_mm": checked.position.x_m * 1e3,
            "y_mm": checked.position.y_m * 1e3,
            "estimate_x_mm": checked.estimate.x_m * 1e3,
            "estimate_y_mm": checked.estimate.y_m * 1e3,
            "error_mm": checked.error_m * 1e3,
            "covered": checked.covered,
        }
    });
    object! {
        "places": places.collect::<Vec<_>>(),
        "median_mm": check.median_m * 1e3,
        "mean_mm": check.mean_m * 1e3,
        "covered": check.covered,
    }
}

/// Prints the events and the operator's next action; `hand` is the extent of the surface.
pub fn print_notes(notes: &[Note], calibration: &Calibration, hand: Option<Extent>) {
    for note in notes {
        match note {
            Note::Opened(name) => alert!("readings from {name}"),
            Note::Lost(why) => alert!("the source is lost: {why}; it is opened again once it is there"),
            Note::NoReadings(words) => alert!("{words}"),
            Note::ReadingsAgain => alert!("readings arrive again"),
            Note::Taken => {
                let rows = calibration.journal().rows();
                let off = last_deviation_percent(rows)
                    .map_or(String::new(), |off| format!(", {off:.2} % off the others of its place"));
                let force = rows.last().and_then(|row| row.force_n);
                let force = force.map_or(String::new(), |force_n| format!(" of {force_n:.3} N"));
                alert!("taken: press {}{force}{off}", calibration.journal().presses());
            }
            Note::RepeatedReadings => alert!("{REPEATED_READINGS}"),
            Note::Replaced => {
                alert!("the reading grew: press {} is recorded again", calibration.journal().presses());
            }
            Note::AskedAgain(reason) => alert!("press rejected: {reason}"),
            Note::StillWaiting(words) => alert!("{words}"),
            Note::Saturated(name) => alert!("channel {name} reads the end of its range"),
            Note::Ended | Note::Waits(_) | Note::Untouched | Note::Overload(_) => {}
        }
        if let (Some(extent), Note::Taken | Note::AskedAgain(_) | Note::Waits(_)) = (hand, note) {
            ask_for(calibration, extent);
        }
    }
}

pub fn ask_for(calibration: &Calibration, extent: Extent) {
    let guide = calibration.guide();
    match (guide.awaited_step(), guide.next_press()) {
        (AwaitedStep::Untouched, _) => alert!("leave the surface alone"),
        (AwaitedStep::Press, Some((number, press))) => {
            alert!("press at {} ({} of {})", place(press, extent), number + 1, guide.plan().len());
        }
        (AwaitedStep::Rest, _) => alert!("hold"),
        (AwaitedStep::Release, _) => alert!("let go"),
        (AwaitedStep::Press | AwaitedStep::Nothing, _) => {}
    }
}

pub fn place(press: Press, extent: Extent) -> String {
    let mm = |at_m: f64| format_length_mm(at_m);
    let place = match extent {
        Extent::Line { .. } => mm(press.position.x_m),
        Extent::Plane { .. } => format!("{}, {}", mm(press.position.x_m), mm(press.position.y_m)),
    };
    press.force_n.map_or_else(|| place.clone(), |force_n| format!("{place} with {force_n} N"))
}
