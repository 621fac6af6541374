//! Raw gauges under surfaces of known physics; readings in counts, with noise of one count.

use anyhow::Result;
use palpate::estimators::influence::{InfluenceLocator, Structure};
use palpate::mechanics::sensing::SensorKind;
use palpate::mechanics::surface::plate::{Edge, Edges, PlateSpec};
use palpate::mechanics::surface::{BeamSection, BeamSupport, BeamSupportKind, SupportedBeamSpec, Surface};
use palpate::prelude::{
    Contact, Extent, Fit, FitTask, Influence, Plate, Position, Recording, Row, Setup, SupportedBeam,
};
use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;

pub const STRIP_M: f64 = 0.3;
pub const PLATE_M: [f64; 2] = [0.2, 0.15];
/// Channels of strip and plate.
pub const GAUGES: usize = 6;
/// Smallest distance of contacts from the ends.
pub const MARGIN_M: f64 = 0.02;
/// Largest influence at gain 1, in counts per newton.
const FULL_SCALE: f64 = 60.0;
const FORCES_N: std::ops::Range<f64> = 0.5..5.0;

/// Counts per newton of each gauge by position.
pub type Influences = Box<dyn Fn(Position) -> Vec<f64> + Send + Sync>;

pub struct RawBench {
    pub extent: Extent,
    pub influences: Influences,
    pub offsets: Vec<f64>,
    pub rng: Xoshiro256PlusPlus,
    pub presses: Vec<Row>,
}

impl RawBench {
    /// Clamped strip over six strain gauges, pressed at even places in turn.
    pub fn strip(seed: u64, presses: usize, places: usize) -> Result<Self> {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
        let clamp = |at_m: f64| BeamSupport { at_m, kind: BeamSupportKind::Clamped };
        let strip = SupportedBeam::new(SupportedBeamSpec {
            length_m: STRIP_M,
            youngs_modulus_pa: 70e9,
            supports: vec![clamp(0.0), clamp(STRIP_M)],
            sections: vec![BeamSection { to_m: STRIP_M, width_m: 0.03, thickness_m: 1e-3 }],
        })?;
        let pitch_m = STRIP_M / GAUGES as f64;
        let gauges: Vec<Position> = (0..GAUGES)
            .map(|i| Position::along(pitch_m * (i as f64 + 0.5 + rng.random_range(-0.25..0.25))))
            .collect();
        let influences = raw_influences(strip, SensorKind::Strain, gauges, &mut rng);
        let place = |i: usize| {
            let share = (i % places) as f64 / (places - 1) as f64;
            Position::along(MARGIN_M + (STRIP_M - 2.0 * MARGIN_M) * share)
        };
        let pressed = (0..presses).map(place).collect();
        Ok(Self::new(Extent::line(STRIP_M)?, GAUGES, influences, pressed, rng))
    }

    /// Simply supported plate over six deflection sensors, pressed twice at each of 10 × 8 places.
    pub fn plate(seed: u64) -> Result<Self> {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
        let [length_m, width_m] = PLATE_M;
        let plate = Plate::new(PlateSpec {
            length_m,
            width_m,
            thickness_m: 1e-3,
            youngs_modulus_pa: 70e9,
            poissons_ratio: 0.3,
            edges: Edges::all(Edge::Simple),
            supports: Vec::new(),
            elements: 24,
        })?;
        let sensors = (0..GAUGES)
            .map(|i| Position {
                x_m: length_m * ((i % 3) as f64 + 1.0 + rng.random_range(-0.2..0.2)) / 4.0,
                y_m: width_m * ((i / 3) as f64 + 1.0 + rng.random_range(-0.2..0.2)) / 3.0,
            })
            .collect();
        let influences = raw_influences(plate, SensorKind::Deflection, sensors, &mut rng);
        let place = |i: usize| {
            let share = |k: usize, n: usize| k as f64 / (n - 1) as f64;
            Position {
                x_m: MARGIN_M + (length_m - 2.0 * MARGIN_M) * share(i % 10, 10),
                y_m: MARGIN_M + (width_m - 2.0 * MARGIN_M) * share(i / 10 % 8, 8),
            }
        };
        let pressed = (0..160).map(place).collect();
        Ok(Self::new(Extent::plane(length_m, width_m)?, GAUGES, influences, pressed, rng))
    }

    /// Gauges with random offsets, pressed with random forces.
    pub fn new(
        extent: Extent,
        gauges: usize,
        influences: Influences,
        pressed: Vec<Position>,
        mut rng: Xoshiro256PlusPlus,
    ) -> Self {
        let offsets = (0..gauges).map(|_| rng.random_range(-500.0..500.0)).collect();
        let mut bench = Self { extent, influences, offsets, rng, presses: Vec::new() };
        bench.presses = pressed.into_iter().map(|at| bench.touch(at)).collect();
        bench
    }

    /// Contact with a random force.
    pub fn touch(&mut self, position: Position) -> Row {
        let force_n = self.rng.random_range(FORCES_N);
        self.row(Contact { position, force_n })
    }

    pub fn row(&mut self, contact: Contact) -> Row {
        let reading = self.reading(contact);
        let Contact { position, force_n } = contact;
        Row { position, force_n: Some(force_n), nuisances: Vec::new(), time_s: None, reading }
    }

    /// With noise, in counts.
    pub fn reading(&mut self, contact: Contact) -> Vec<f64> {
        let mut reading = self.clean_reading(contact);
        for value in &mut reading {
            let noise: f64 = StandardNormal.sample(&mut self.rng);
            *value += noise;
        }
        reading
    }

    /// Without noise, in counts.
    pub fn clean_reading(&self, contact: Contact) -> Vec<f64> {
        let influences = (self.influences)(contact.position).into_iter().zip(&self.offsets);
        influences.map(|(influence, offset)| offset + contact.force_n * influence).collect()
    }

    /// Contacts within the margins.
    pub fn touches(&mut self, count: usize) -> Vec<Row> {
        let size_m = [self.extent.length_m(), self.extent.width_m().unwrap_or(0.0)];
        (0..count)
            .map(|_| {
                let x_m = self.rng.random_range(MARGIN_M..size_m[0] - MARGIN_M);
                let across =
                    self.extent.width_m().map(|width_m| self.rng.random_range(MARGIN_M..width_m - MARGIN_M));
                self.touch(Position { x_m, y_m: across.unwrap_or(0.0) })
            })
            .collect()
    }

    /// Setup without a model.
    pub fn setup(&self) -> Result<Setup> {
        let names: Vec<String> = (0..self.offsets.len()).map(|c| format!("gauge_{c}")).collect();
        let names: Vec<&str> = names.iter().map(String::as_str).collect();
        let length_m = self.extent.length_m();
        Ok(match self.extent.width_m() {
            None => Setup::measured(length_m, &names)?,
            Some(width_m) => Setup::measured_plane(length_m, width_m, &names)?,
        })
    }

    /// Fits the influence estimator to the presses.
    pub fn fit(&self, structure: Structure, known_force_n: Option<f64>) -> Result<InfluenceLocator> {
        let mut setup = self.setup()?;
        if let Some(force_n) = known_force_n {
            setup = setup.known_force(force_n)?;
        }
        let recording = Recording::new(setup.layout(), "bench", self.presses.clone());
        let influence = Influence { structure, ..Influence::default() };
        Ok(influence.fit_method(FitTask::new(&setup, &recording))?)
    }
}

/// Counts per newton of gauges with different gains.
fn raw_influences(
    surface: impl Surface + 'static,
    kind: SensorKind,
    gauges: Vec<Position>,
    rng: &mut Xoshiro256PlusPlus,
) -> Influences {
    let scale = FULL_SCALE / surface.full_scale(kind);
    let gains: Vec<f64> = gauges.iter().map(|_| scale * rng.random_range(0.7..1.3)).collect();
    Box::new(move |at| {
        let functions = gauges.iter().map(|gauge| surface.influence_function(kind, *gauge));
        functions.zip(&gains).map(|(function, gain)| gain * function.at(at)).collect()
    })
}
