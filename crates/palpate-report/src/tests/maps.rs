//! Tests of heat maps.

use super::parse_drawing;
use crate::{HeatMap, HeatPanel, heat_map_to_svg};
use palpate_estimators::load_profile::Cells;
use palpate_mechanics::surface::Extent;

fn map(panels: usize, width_m: f64, values: impl Fn(usize) -> f64) -> HeatMap {
    let cells = Cells { extent: Extent::plane(0.3, width_m).unwrap(), columns: 6, rows: 4 };
    let panel = |i| HeatPanel::new(format!("panel {i} <&>"), (0..cells.len()).map(&values).collect());
    HeatMap {
        title: "Errors over a plate, of every estimator that has a name, and the limit beside them"
            .to_owned(),
        cells,
        panels: (0..panels).map(panel).collect(),
        dots_mm: vec![(0.0, 0.0), (300.0, width_m * 1e3)],
        label: "error, mm".to_owned(),
        most: 100.0,
        width_px: 860,
    }
}

#[test]
fn texts_of_maps_lie_inside_the_image_and_apart() {
    for panels in [0, 1, 2, 4, 9] {
        for width_m in [0.02, 0.1, 0.3, 0.9] {
            for values in [|i| i as f64, |i| 10_f64.powi(i as i32), |_| f64::NAN] {
                let case = format!("{panels} panels, {width_m} m wide");
                for width_px in [360, 860] {
                    let map = HeatMap { width_px, ..map(panels, width_m, values) };
                    let seen = parse_drawing(&heat_map_to_svg(&map));
                    seen.assert_texts_inside(&case);
                    seen.assert_texts_apart(&case);
                }
            }
        }
    }
}

#[test]
fn titles_and_names_are_whole_on_a_phone() {
    let title = "The least standard deviation of a located contact".to_owned();
    let mut map = HeatMap { title, width_px: 360, ..map(2, 0.3, |i| i as f64) };
    map.panels[1].name = "force unknown, estimated along".to_owned();
    let svg = heat_map_to_svg(&map);
    assert!(svg.contains(&map.panels[1].name) && !svg.contains('…'), "{svg}");
}

#[test]
fn a_cell_without_a_value_stays_grey() {
    let drawn = |svg: &str| parse_drawing(svg).shapes.len();
    let whole = drawn(&heat_map_to_svg(&map(1, 0.3, |i| i as f64)));
    let part = drawn(&heat_map_to_svg(&map(1, 0.3, |i| if i < 5 { f64::NAN } else { i as f64 })));
    assert_eq!(whole - part, 5);
}
