//! A track as a line of CSV or JSON.

use crate::failure::{Complaint, Failure};
use palpate_estimators::estimator::{Across, Track, Tracked};
use palpate_estimators::recording::csv_row;
use palpate_mechanics::surface::Extent;

/// What a line of CSV has room for; the cells of a contact that does not touch are empty.
#[derive(Clone, Copy)]
pub enum Columns {
    /// One contact on a line.
    One,
    /// Two contacts on a line.
    Two,
    /// One contact on a plane.
    Plane,
}

impl Columns {
    pub fn heading(self) -> String {
        let one = "time_s,position_mm,speed_m_per_s,force_n,low_mm,high_mm,touching";
        let second = "position_2_mm,speed_2_m_per_s,force_2_n,low_2_mm,high_2_mm,two_touching";
        match self {
            Self::One => one.to_owned(),
            Self::Two => format!("{one},{second}"),
            Self::Plane => "time_s,x_mm,y_mm,speed_x_m_per_s,speed_y_m_per_s,force_n,x_low_mm,x_high_mm,y_low_mm,y_high_mm,touching".to_owned(),
        }
    }

    /// A line of CSV.
    pub fn csv(self, track: &Track) -> String {
        let (first, second) = (track.contacts.first(), track.contacts.get(1));
        let mut cells = vec![track.time_s.to_string()];
        cells.extend(match self {
            Self::One | Self::Two => cells_on_line(first),
            Self::Plane => cells_on_plane(first),
        });
        cells.push(cell(track.touching()));
        if let Self::Two = self {
            cells.extend(cells_on_line(second));
            cells.push(cell(track.numbers[2]));
        }
        csv_row(cells)
    }
}

fn cells_on_line(contact: Option<&Tracked>) -> Vec<String> {
    let Some(tracked) = contact else { return vec![String::new(); 5] };
    let (low_m, high_m) = tracked.x_95_m;
    [tracked.x_m * 1e3, tracked.speed_m_per_s, tracked.force_n, low_m * 1e3, high_m * 1e3].map(cell).to_vec()
}

fn cells_on_plane(contact: Option<&Tracked>) -> Vec<String> {
    let on_plane = contact.and_then(|tracked| Some((tracked, tracked.across?)));
    let Some((tracked, across)) = on_plane else { return vec![String::new(); 9] };
    let ((x_low_m, x_high_m), (y_low_m, y_high_m)) = (tracked.x_95_m, across.y_95_m);
    let numbers = [
        tracked.x_m * 1e3,
        across.y_m * 1e3,
        tracked.speed_m_per_s,
        across.speed_m_per_s,
        tracked.force_n,
        x_low_m * 1e3,
        x_high_m * 1e3,
        y_low_m * 1e3,
        y_high_m * 1e3,
    ];
    numbers.map(cell).to_vec()
}

fn cell(number: f64) -> String {
    format!("{number:.4}")
}

/// A track as JSON.
#[derive(serde::Serialize)]
struct JsonTrack {
    line: u64,
    time_s: f64,
    touching: f64,
    /// The first contact, or the only one.
    #[serde(flatten)]
    contact: Option<JsonContact>,
    two_touching: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    second: Option<JsonContact>,
    /// Where the reading by itself shows the contact; on a plane its x and y.
    single_mm: JsonPosition,
    single_status: &'static str,
}

#[derive(serde::Serialize)]
#[serde(untagged)]
enum JsonPosition {
    OnLine(f64),
    OnPlane([f64; 2]),
}

#[derive(serde::Serialize)]
struct JsonContact {
    x_mm: f64,
    speed_m_per_s: f64,
    force_n: f64,
    x_95_mm: [f64; 2],
    sd_mm: f64,
    sd_speed_m_per_s: f64,
    sd_force_n: f64,
    #[serde(flatten)]
    across: Option<JsonAcross>,
}

#[derive(serde::Serialize)]
struct JsonAcross {
    y_mm: f64,
    speed_y_m_per_s: f64,
    y_95_mm: [f64; 2],
    sd_y_mm: f64,
    sd_speed_y_m_per_s: f64,
    covariance_mm2: f64,
}

/// A line of JSON: all that is known of the reading in line `line` of its source.
pub fn json(track: &Track, line: u64, extent: Extent) -> Result<String, Failure> {
    let position = track.alone.contact.position;
    let object = JsonTrack {
        line,
        time_s: track.time_s,
        touching: track.touching(),
        contact: track.contacts.first().map(json_contact),
        two_touching: track.numbers[2],
        second: track.contacts.get(1).map(json_contact),
        single_mm: match extent {
            Extent::Line { .. } => JsonPosition::OnLine(position.x_m * 1e3),
            Extent::Plane { .. } => JsonPosition::OnPlane([position.x_m * 1e3, position.y_m * 1e3]),
        },
        single_status: track.alone.status.name(),
    };
    serde_json::to_string(&object).map_err(|error| Complaint::new(error).into())
}

fn json_contact(tracked: &Tracked) -> JsonContact {
    let mm = |(low_m, high_m): (f64, f64)| [low_m * 1e3, high_m * 1e3];
    let [sd_m, sd_speed_m_per_s, sd_force_n] = tracked.sd;
    let across = |across: Across| JsonAcross {
        y_mm: across.y_m * 1e3,
        speed_y_m_per_s: across.speed_m_per_s,
        y_95_mm: mm(across.y_95_m),
        sd_y_mm: across.sd[0] * 1e3,
        sd_speed_y_m_per_s: across.sd[1],
        covariance_mm2: across.covariance_m2 * 1e6,
    };
    JsonContact {
        x_mm: tracked.x_m * 1e3,
        speed_m_per_s: tracked.speed_m_per_s,
        force_n: tracked.force_n,
        x_95_mm: mm(tracked.x_95_m),
        sd_mm: sd_m * 1e3,
        sd_speed_m_per_s,
        sd_force_n,
        across: tracked.across.map(across),
    }
}
