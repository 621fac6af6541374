//! `[recording]`

use std::ops::Range;

use toml::Spanned;

use crate::error::{RigError, RigProblem};
use crate::sections::{RecordingSection, UnitNames};
use crate::value::{RawColumn, RawQuantity, out_of_range, positive, quantity};
use palpate_estimators::recording::{
    Column, Columns, ForceColumn, Frame, Header, Need, PositionColumns, ValueColumn,
};
use palpate_mechanics::contact::Position;
use palpate_mechanics::sensing::{Layout, SensorKind};
use palpate_mechanics::surface::Extent;
use palpate_mechanics::units::{Dimension, Unit, UnitError};

/// What the section does not say is as in the recordings that palpate itself writes.
pub(super) fn validate(
    section: Option<&Spanned<RecordingSection>>,
    layout: &Layout,
    extent: Extent,
) -> Result<Option<Columns>, RigError> {
    let Some(section) = section else { return Ok(None) };
    let keys = section.get_ref();
    let own = Columns::own(&layout.names(), &layout.kinds(), extent);
    let header = if keys.header.unwrap_or(true) { Header::Present } else { Header::Absent };
    let columns = Columns {
        header,
        position: position(section, extent)?.unwrap_or(own.position),
        position_unit: keys.position_unit.as_ref().map_or(Ok(own.position_unit), |raw| {
            unit("position_unit", raw.get_ref(), raw.span(), Dimension::Length)
        })?,
        frame: frame(keys, extent)?,
        channels: channels(keys, layout, own.channels)?,
        force: force(keys, own.force)?,
        hidden: hidden(keys)?,
    };
    check_numbered(&columns, section)?;
    Ok(Some(columns))
}

fn position(
    section: &Spanned<RecordingSection>,
    extent: Extent,
) -> Result<Option<PositionColumns>, RigError> {
    let keys = section.get_ref();
    let unused = |key, with, span| Err(RigProblem::UnusedKey { key, with }.at(span));
    let missing = |key| Err(RigProblem::MissingKey { section: "recording", key }.at(section.span()));
    match (&keys.position, &keys.x, &keys.y) {
        (None, None, None) => Ok(None),
        (Some(_), Some(x), _) => unused("x", "`position`", x.span()),
        (Some(_), None, Some(y)) => unused("y", "`position`", y.span()),
        (Some(raw), None, None) if extent.width_m.is_some() => {
            unused("position", "a surface that has a width; use `x` and `y`", raw.span())
        }
        (Some(raw), None, None) => Ok(Some(PositionColumns::Along(column("position", raw)?))),
        (None, Some(_), None) => missing("y"),
        (None, None, Some(_)) => missing("x"),
        (None, Some(_), Some(y)) if extent.width_m.is_none() => {
            unused("y", "a surface without a width", y.span())
        }
        (None, Some(x), Some(y)) => {
            Ok(Some(PositionColumns::Plane { x: column("x", x)?, y: column("y", y)? }))
        }
    }
}

fn column(key: &'static str, raw: &Spanned<RawColumn>) -> Result<Column, RigError> {
    match raw.get_ref() {
        RawColumn::Name(name) => Ok(Column::Name(name.trim().to_owned())),
        RawColumn::Number(number) => match usize::try_from(*number) {
            Ok(number) if number > 0 => Ok(Column::Number(number)),
            _ => Err(out_of_range(key, &Spanned::new(raw.span(), *number), "a column's number, at least 1")),
        },
    }
}

fn unit(key: &'static str, symbol: &str, span: Range<usize>, wanted: Dimension) -> Result<Unit, RigError> {
    match Unit::from_symbol(symbol) {
        Some(unit) if unit.dimension() == wanted => Ok(unit),
        _ if wanted == Dimension::None => {
            Err(RigProblem::Unit { key, error: UnitError::UnwantedUnit { text: symbol.to_owned() } }.at(span))
        }
        _ => {
            let error = UnitError::WrongUnit { unit: symbol.to_owned(), wanted };
            Err(RigProblem::Unit { key, error }.at(span))
        }
    }
}

fn channels(
    keys: &RecordingSection,
    layout: &Layout,
    own: Vec<ValueColumn>,
) -> Result<Vec<ValueColumn>, RigError> {
    let kinds = layout.kinds();
    let units = channel_units(keys, &kinds)?;
    let Some(listed) = &keys.channels else {
        return Ok(own
            .into_iter()
            .zip(units)
            .map(|(channel, unit)| ValueColumn { unit, ..channel })
            .collect());
    };
    let columns =
        listed.get_ref().iter().map(|raw| column("channels", raw)).collect::<Result<Vec<_>, _>>()?;
    if columns.len() != kinds.len() {
        let problem =
            RigProblem::ChannelCount { key: "channels", listed: columns.len(), sensors: kinds.len() };
        return Err(problem.at(listed.span()));
    }
    for (second, column) in columns.iter().enumerate() {
        if let Some(first) = columns[..second].iter().position(|earlier| earlier == column) {
            let span = listed.get_ref()[second].span();
            return Err(RigProblem::SameColumn { first: first + 1, second: second + 1 }.at(span));
        }
    }
    Ok(columns.into_iter().zip(units).map(|(column, unit)| ValueColumn { column, unit }).collect())
}

/// One unit per sensor: those given, or those in which palpate writes.
fn channel_units(keys: &RecordingSection, kinds: &[SensorKind]) -> Result<Vec<Unit>, RigError> {
    let Some(raw) = &keys.channel_unit else { return Ok(kinds.iter().map(|kind| kind.unit()).collect()) };
    let key = "channel_unit";
    match raw.get_ref() {
        UnitNames::One(symbol) => {
            kinds.iter().map(|kind| unit(key, symbol, raw.span(), kind.dimension())).collect()
        }
        UnitNames::Each(symbols) if symbols.len() == kinds.len() => {
            let each = kinds.iter().zip(symbols);
            each.map(|(kind, symbol)| unit(key, symbol.get_ref(), symbol.span(), kind.dimension())).collect()
        }
        UnitNames::Each(symbols) => {
            Err(RigProblem::ChannelCount { key, listed: symbols.len(), sensors: kinds.len() }.at(raw.span()))
        }
    }
}

fn force(keys: &RecordingSection, own: Option<ForceColumn>) -> Result<Option<ForceColumn>, RigError> {
    let Some(raw) = &keys.force else {
        return match &keys.force_unit {
            Some(unit) => Err(RigProblem::MissingKey { section: "recording", key: "force" }.at(unit.span())),
            None => Ok(own),
        };
    };
    let unit = keys.force_unit.as_ref().map_or(Ok(SensorKind::Reaction.unit()), |raw| {
        unit("force_unit", raw.get_ref(), raw.span(), Dimension::Force)
    })?;
    Ok(Some(ForceColumn {
        values: ValueColumn { column: column("force", raw)?, unit },
        need: Need::Required,
    }))
}

fn hidden(keys: &RecordingSection) -> Result<Option<ValueColumn>, RigError> {
    let missing = |unit: &Spanned<String>| {
        Err(RigProblem::MissingKey { section: "recording", key: "hidden" }.at(unit.span()))
    };
    match (&keys.hidden, &keys.hidden_unit) {
        (None, None) => Ok(None),
        (None, Some(unit)) => missing(unit),
        (Some(raw), None) => Ok(Some(ValueColumn { column: column("hidden", raw)?, unit: Unit::NONE })),
        (Some(raw), Some(symbol)) => {
            let unit = Unit::from_symbol(symbol.get_ref()).ok_or_else(|| {
                let error = UnitError::UnknownUnit { unit: symbol.get_ref().clone() };
                RigProblem::Unit { key: "hidden_unit", error }.at(symbol.span())
            })?;
            Ok(Some(ValueColumn { column: column("hidden", raw)?, unit }))
        }
    }
}

/// Origin and rounding; as many coordinates as the surface has.
fn frame(keys: &RecordingSection, extent: Extent) -> Result<Frame, RigError> {
    let round_m = keys.round.as_ref().map(|raw| positive("round", raw, Dimension::Length)).transpose()?;
    let Some(raw) = &keys.origin else { return Ok(Frame { round_m, ..Frame::default() }) };
    let length = |value: &Spanned<RawQuantity>| quantity("origin", value, Dimension::Length);
    let origin = match (raw.get_ref().as_slice(), extent.width_m) {
        ([x], None) => Position::along(length(x)?),
        ([x, y], Some(_)) => Position { x_m: length(x)?, y_m: length(y)? },
        (listed, width) => {
            let bound = if width.is_some() { "a list of 2, x and y" } else { "a list of 1" };
            let value = format!("a list of {}", listed.len());
            return Err(RigProblem::OutOfRange { key: "origin", value, bound }.at(raw.span()));
        }
    };
    Ok(Frame { origin, round_m })
}

/// Without a header, columns must be numbers; an optional one that has a name is simply not there.
fn check_numbered(columns: &Columns, section: &Spanned<RecordingSection>) -> Result<(), RigError> {
    if columns.header == Header::Present {
        return Ok(());
    }
    let position = match &columns.position {
        PositionColumns::Along(x) => vec![x],
        PositionColumns::Plane { x, y } => vec![x, y],
    };
    let force =
        columns.force.iter().filter(|force| force.need == Need::Required).map(|force| &force.values.column);
    let channels = columns.channels.iter().map(|channel| &channel.column);
    let hidden = columns.hidden.iter().map(|hidden| &hidden.column);
    for column in position.into_iter().chain(force).chain(hidden).chain(channels) {
        if let Column::Name(name) = column {
            let span = place_of(name, section);
            return Err(RigProblem::NameWithoutHeader { name: name.clone() }.at(span));
        }
    }
    Ok(())
}

/// Where the section names the column `name`; the whole section when it does not.
fn place_of(name: &str, section: &Spanned<RecordingSection>) -> Range<usize> {
    let keys = section.get_ref();
    let single = [&keys.position, &keys.x, &keys.y, &keys.force, &keys.hidden].into_iter().flatten();
    let listed = keys.channels.iter().flat_map(|channels| channels.get_ref());
    let named = |raw: &&Spanned<RawColumn>| matches!(raw.get_ref(), RawColumn::Name(written) if written.trim() == name);
    single.chain(listed).find(named).map_or_else(|| section.span(), Spanned::span)
}
