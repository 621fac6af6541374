//! Plates: edges and supports.

use super::*;
use palpate_estimators::simulate::clean_reading;
use palpate_mechanics::contact::{Contact, Position};
use palpate_mechanics::surface::plate::{Edge, Edges, PlateSpec, PointSupport, PointSupportKind};

const EXAMPLE: &str = include_str!("../../../../examples/plate.toml");

const PLATE: &str = r#"[surface]
kind = "plate"
length = "300 mm"
width = "200 mm"
thickness = "0.8 mm"
youngs_modulus = "200 GPa"
poissons_ratio = 0.3
edges = "free"
supports = [
  { at = ["10 mm", "10 mm"], kind = "simple" },
  { at = ["290 mm", "10 mm"], kind = "simple" },
  { at = ["150 mm", "190 mm"], kind = "elastic", stiffness = "5 N/mm" },
]
elements = 16
[sensors]
measure = "deflection"
grid = [3, 3]
[contact]
force = "5 N"
"#;

fn spec(text: &str) -> PlateSpec {
    let rig = Rig::from_toml(text).unwrap_or_else(|error| panic!("{error}"));
    let SurfaceSpec::Plate(plate) = rig.setup.surface() else { panic!("{:?}", rig.setup.surface()) };
    plate.spec().clone()
}

#[test]
fn edges_and_supports_are_those_of_the_rig() {
    let found = spec(PLATE);
    let place = |x_m, y_m| Position { x_m, y_m };
    assert_eq!((found.length_m, found.width_m, found.elements), (0.3, 0.2, 16));
    assert_eq!(found.edges, Edges::all(Edge::Free));
    let elastic = PointSupportKind::Elastic { stiffness_n_per_m: 5e3 };
    assert_eq!(
        found.supports[0],
        PointSupport { position: place(0.01, 0.01), kind: PointSupportKind::Simple }
    );
    assert_eq!(found.supports[2], PointSupport { position: place(0.15, 0.19), kind: elastic });
    let mixed = PLATE.replace("\"free\"", "{ left = \"clamped\", bottom = \"simple\" }");
    let edges = Edges { left: Edge::Clamped, right: Edge::Free, bottom: Edge::Simple, top: Edge::Free };
    assert_eq!(spec(&mixed).edges, edges);
    assert_eq!(spec(&PLATE.replace("elements = 16\n", "")).elements, PlateSpec::DEFAULT_ELEMENTS);
}

/// 0.011601·P·a²/D at the centre (Timoshenko and Woinowsky-Krieger, table 23).
#[test]
fn five_newtons_in_the_middle_of_the_examples_plate_deflect_it_by_0_557_mm() {
    let rig = Rig::from_toml(EXAMPLE).unwrap_or_else(|error| panic!("{error}"));
    let training = rig.training.as_ref().unwrap();
    let positions = training.positions(rig.setup.surface().extent()).unwrap();
    assert_eq!((rig.setup.layout().len(), positions.len(), training.repeats), (9, 36, 5));
    let position = Position { x_m: 0.15, y_m: 0.15 };
    let force_n = rig.setup.force_n().unwrap();
    let reading = clean_reading(
        rig.setup.surface().model().unwrap(),
        rig.setup.layout(),
        Contact { position, force_n },
    );
    assert_eq!(format!("{:.3} mm", reading[4] * 1e3), "-0.557 mm");
}

#[test]
fn a_bad_plate_is_refused_with_a_caret() {
    let shown = refused(
        PLATE,
        &[
            ("thickness = \"0.8 mm\"", "thickness = \"0 mm\""),
            ("poissons_ratio = 0.3", "poissons_ratio = 0.6"),
            ("poissons_ratio = 0.3\n", ""),
            ("\"free\"", "\"hinged\""),
            ("\"free\"", "{ left = \"clamped\", east = \"free\" }"),
            ("\"free\"", "{ left = \"clmaped\" }"),
            ("\"free\"", "3"),
            ("[\"290 mm\", \"10 mm\"]", "[\"310 mm\", \"10 mm\"]"),
            ("[\"290 mm\", \"10 mm\"]", "[\"10 mm\", \"10 mm\"]"),
            ("[\"290 mm\", \"10 mm\"]", "[\"12 mm\", \"10 mm\"]"),
            ("[\"290 mm\", \"10 mm\"]", "\"290 mm\""),
            ("[\"290 mm\", \"10 mm\"]", "[\"290 mm\"]"),
            ("[\"150 mm\", \"190 mm\"]", "[\"150 mm\", \"10 mm\"]"),
            ("kind = \"elastic\", ", ""),
            ("\"elastic\"", "\"simple\""),
            ("\"elastic\"", "\"clamped\""),
            (", stiffness = \"5 N/mm\"", ""),
            ("\"5 N/mm\"", "\"5 N\""),
            ("\"5 N/mm\"", "\"0 N/mm\""),
            ("stiffness = ", "rotational_stiffness = "),
            ("supports = [", "supports = \"simple\"\nother = ["),
            ("elements = 16", "elements = 0"),
            ("elements = 16", "elements = 3"),
            ("elements = 16", "elements = 3000"),
            ("\"deflection\"", "\"raw\""),
        ],
    );
    insta::assert_snapshot!(shown);
}

#[test]
fn insensitive_sensor_is_refused_with_a_caret() {
    let simple = PLATE
        .replace("\"free\"", "{ bottom = \"clamped\" }")
        .replace("grid = [3, 3]", "positions = [[\"50 mm\", \"50 mm\"], [\"10 mm\", \"10 mm\"]]");
    let shown = refused(
        &simple,
        &[
            ("measure", "measure"),
            ("[\"10 mm\", \"10 mm\"]]", "[\"10 mm\", \"0 mm\"]]"),
            ("\"deflection\"", "\"reaction\""),
        ],
    );
    insta::assert_snapshot!(shown);
}

#[test]
fn keys_of_plates_go_with_no_other_surface() {
    let shown = refused(
        BENCH,
        &[
            ("[sensors]", "edges = \"simple\"\n[sensors]"),
            ("[sensors]", "poissons_ratio = 0.3\n[sensors]"),
            ("[sensors]", "supports = []\n[sensors]"),
        ],
    );
    insta::assert_snapshot!(shown);
}
