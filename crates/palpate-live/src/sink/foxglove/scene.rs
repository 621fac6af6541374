//! Surface and contact for the 3D panel of Foxglove: metres in the frame `surface`, x along, y across, z out
//! of it.

use foxglove::messages::scene_entity_deletion::Type;
use foxglove::messages::{
    ArrowPrimitive, Color, CubePrimitive, Pose, Quaternion, SceneEntity, SceneEntityDeletion, SceneUpdate,
    Timestamp, Vector3,
};
use palpate_core::{Estimate, Position, Status};
use palpate_mechanics::surface::Extent;
use std::f64::consts::FRAC_1_SQRT_2;

const FRAME: &str = "surface";
const SURFACE_ID: &str = "surface";
const CONTACT_ID: &str = "contact";
const GREY: Color = Color { r: 0.6, g: 0.6, b: 0.65, a: 0.6 };
const LOCATED: Color = Color { r: 0.1, g: 0.65, b: 0.3, a: 1.0 };
const DOUBTED: Color = Color { r: 0.95, g: 0.6, b: 0.1, a: 1.0 };

pub struct Scene {
    /// Size of the slab; the width of a line and the thickness are arbitrary.
    size_m: [f64; 3],
    /// The axis of a line is at 0.
    edge_y_m: f64,
}

impl Scene {
    pub fn new(extent: Extent) -> Self {
        let length_m = extent.length_m();
        let (width_m, edge_y_m) = match extent.width_m() {
            Some(width_m) => (width_m, 0.0),
            None => (0.1 * length_m, -0.05 * length_m),
        };
        Self { size_m: [length_m, width_m, 0.01 * length_m.max(width_m)], edge_y_m }
    }

    /// Surface, repeated for later subscribers, and contact as an arrow: green if located, else amber.
    pub fn update(&self, estimate: &Estimate, unix_ns: u64) -> SceneUpdate {
        let color = match estimate.status {
            Status::NoContact => None,
            Status::Located => Some(LOCATED),
            Status::Ambiguous | Status::OutsideModel | Status::OutsideSurface => Some(DOUBTED),
        };
        let timestamp = timestamp(unix_ns);
        let mut update = SceneUpdate {
            deletions: Vec::new(),
            entities: vec![entity(SURFACE_ID, timestamp, vec![self.slab()], Vec::new())],
        };
        match color {
            Some(color) => {
                let arrow = self.arrow(estimate.contact.position, color);
                update.entities.push(entity(CONTACT_ID, timestamp, Vec::new(), vec![arrow]));
            }
            None => update.deletions.push(SceneEntityDeletion {
                timestamp: Some(timestamp),
                r#type: Type::MatchingId as i32,
                id: CONTACT_ID.to_owned(),
            }),
        }
        update
    }

    fn slab(&self) -> CubePrimitive {
        let [length_m, width_m, thickness_m] = self.size_m;
        let middle = [0.5 * length_m, self.edge_y_m + 0.5 * width_m, -0.5 * thickness_m];
        CubePrimitive {
            pose: Some(pose(middle, Quaternion { x: 0.0, y: 0.0, z: 0.0, w: 1.0 })),
            size: Some(Vector3 { x: length_m, y: width_m, z: thickness_m }),
            color: Some(GREY),
        }
    }

    fn arrow(&self, Position { x_m, y_m }: Position, color: Color) -> ArrowPrimitive {
        let length_m = 0.2 * self.size_m[0].max(self.size_m[1]);
        // Arrows point along x; a quarter turn about y makes this one point along −z.
        let down = Quaternion { x: 0.0, y: FRAC_1_SQRT_2, z: 0.0, w: FRAC_1_SQRT_2 };
        ArrowPrimitive {
            pose: Some(pose([x_m, y_m, length_m], down)),
            shaft_length: 0.7 * length_m,
            shaft_diameter: 0.1 * length_m,
            head_length: 0.3 * length_m,
            head_diameter: 0.2 * length_m,
            color: Some(color),
        }
    }
}

fn entity(
    id: &str,
    timestamp: Timestamp,
    cubes: Vec<CubePrimitive>,
    arrows: Vec<ArrowPrimitive>,
) -> SceneEntity {
    SceneEntity {
        timestamp: Some(timestamp),
        frame_id: FRAME.to_owned(),
        id: id.to_owned(),
        cubes,
        arrows,
        ..SceneEntity::default()
    }
}

fn pose([x, y, z]: [f64; 3], orientation: Quaternion) -> Pose {
    Pose { position: Some(Vector3 { x, y, z }), orientation: Some(orientation) }
}

fn timestamp(unix_ns: u64) -> Timestamp {
    let seconds = u32::try_from(unix_ns / 1_000_000_000).unwrap_or(u32::MAX);
    Timestamp::new(seconds, (unix_ns % 1_000_000_000) as u32)
}
