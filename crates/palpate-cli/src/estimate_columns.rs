//! Columns of estimates in CSV.

use palpate_estimators::estimate_record::{ContactRecord, EstimateRecord};
use palpate_estimators::estimator::{Locator, Status};
use palpate_estimators::recording::csv_row;
use palpate_mechanics::surface::Extent;

/// Columns of estimates, after those of their readings. Values that a locator does not estimate are
/// empty.
#[derive(Clone, Copy)]
pub struct EstimateColumns {
    extent: Extent,
    contacts: usize,
    rows: EstimateRows,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EstimateRows {
    /// Rows that are neither `no_contact` nor `outside_model`, so that column averages are of
    /// contacts.
    OfContacts,
    OfAll,
}

impl EstimateRows {
    pub fn by_option(all: bool) -> Self {
        if all { Self::OfAll } else { Self::OfContacts }
    }
}

impl EstimateColumns {
    pub fn new(locator: &Locator, guesses: EstimateRows) -> Self {
        let extent = locator.setup.surface().extent();
        Self { extent, contacts: locator.most_contacts(), rows: guesses }
    }

    pub fn heading(self, first: &str) -> String {
        let contact = match self.extent {
            Extent::Line { .. } => "position_mm,force_n,low_mm,high_mm,force_low_n,force_high_n",
            Extent::Plane { .. } => {
                "x_mm,y_mm,force_n,x_low_mm,x_high_mm,y_low_mm,y_high_mm,force_low_n,force_high_n"
            }
        };
        let further: String = (2..=self.contacts)
            .map(|n| {
                format!(
                    ",position_{n}_mm,force_{n}_n,low_{n}_mm,high_{n}_mm,force_low_{n}_n,force_high_{n}_n"
                )
            })
            .collect();
        format!("{first},{contact},trade_off,status{further}\n")
    }

    pub fn row(self, first: Vec<String>, estimate: &EstimateRecord) -> String {
        let without_contact = [Status::NoContact, Status::OutsideModel].map(Status::name);
        let has_contact = self.rows == EstimateRows::OfAll || !without_contact.contains(&estimate.status);
        let contacts = std::iter::once(&estimate.contact).chain(&estimate.further);
        let contacts: Vec<&ContactRecord> = contacts.filter(|_| has_contact).collect();
        self.row_of(first, &contacts, estimate.status)
    }

    pub fn empty_row(self, first: Vec<String>, status: &str) -> String {
        self.row_of(first, &[], status)
    }

    fn row_of(self, mut cells: Vec<String>, contacts: &[&ContactRecord], status: &str) -> String {
        let contact = |number: usize| contacts.get(number).copied();
        cells.extend(self.cells(contact(0)));
        cells.push(contact(0).and_then(|first| first.trade_off).unwrap_or_default().to_owned());
        cells.push(status.to_owned());
        cells.extend((1..self.contacts).flat_map(|number| self.cells(contact(number))));
        csv_row(cells)
    }

    fn cells(self, contact: Option<&ContactRecord>) -> Vec<String> {
        let is_plane = matches!(self.extent, Extent::Plane { .. });
        let number = |value: Option<f64>| value.map_or_else(String::new, |value| format!("{value:.4}"));
        let ends = |ends: Option<[f64; 2]>| [0, 1].map(|end| number(ends.map(|ends| ends[end])));
        let mut cells = vec![number(contact.map(|contact| contact.x_mm))];
        cells.extend(is_plane.then(|| number(contact.and_then(|contact| contact.y_mm))));
        cells.push(number(contact.and_then(|contact| contact.force_n)));
        cells.extend(ends(contact.and_then(|contact| contact.x_95_mm)));
        if is_plane {
            cells.extend(ends(contact.and_then(|contact| contact.y_95_mm)));
        }
        cells.extend(ends(contact.and_then(ContactRecord::force_interval_95_n)));
        cells
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate_estimators::estimator::Estimate;
    use palpate_mechanics::contact::Position;

    #[test]
    fn rows_without_a_contact_have_no_place_unless_asked() {
        let extent = Extent::line(0.4).unwrap();
        let place = |status: Status, guesses: EstimateRows| {
            let columns = EstimateColumns { extent, contacts: 2, rows: guesses };
            let estimate = Estimate::of_position(Position::along(0.125), status);
            let row = columns.row(vec!["7".to_owned()], &EstimateRecord::new(&estimate, extent));
            let cells: Vec<&str> = row.trim_end().split(',').collect();
            assert_eq!(cells.len(), columns.heading("line").split(',').count());
            assert_eq!((cells[0], cells[8]), ("7", status.name()));
            cells[1].to_owned()
        };
        for status in [Status::NoContact, Status::OutsideModel] {
            assert_eq!(place(status, EstimateRows::OfContacts), "");
            assert_eq!(place(status, EstimateRows::OfAll), "125.0000");
        }
        for status in [Status::Located, Status::Ambiguous, Status::OutsideSurface] {
            assert_eq!(place(status, EstimateRows::OfContacts), "125.0000");
        }
    }
}
