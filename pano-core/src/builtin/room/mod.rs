//! A furnished living room of 5 × 4 × 2.7 m, with a table to put virtual objects on: the scene of `pano demo`.
//!
//! The origin is the floor's middle, under the table. The left wall (−X) has a window: a quad of constant radiance that
//! closes the opening and so is exactly a constant sky at infinity. It gives about half of the light; the other half, warm,
//! comes from a hanging globe and a standing lamp.

mod build;
mod furniture;
mod objects;
mod shell;
mod textures;

#[cfg(test)]
mod tests;

use crate::material::Material;
use crate::mesh::Mesh;
use glam::{Vec2, Vec3};

/// Inner sizes in metres: along X, along Z, and up.
const WIDTH: f32 = 5.0;
const DEPTH: f32 = 4.0;
const CEILING: f32 = 2.7;

/// The table top's extent along X and Z, and its height.
const TABLE_SIZE: Vec2 = Vec2::new(1.4, 0.8);
const TABLE_TOP: f32 = 0.75;

/// An object to insert into the room's picture.
#[derive(Clone, Debug)]
pub struct RoomObject {
    /// What it is, in a word or two.
    pub name: &'static str,
    /// Its shape, the lowest point at y = 0; no materials of its own.
    pub mesh: Mesh,
    /// Its only material.
    pub material: Material,
    /// Where its origin stands, in world metres.
    pub position: Vec3,
    /// Degrees about +Y, counter-clockwise seen from above.
    pub yaw: f32,
}

/// The room, where to capture and look at it, and what to put into it.
#[derive(Clone, Debug)]
pub struct Room {
    /// Everything real, with materials, in world space.
    pub mesh: Mesh,
    /// Materials that are openings to the sky: a capture has no depth there.
    pub window_materials: Vec<u32>,
    /// Where the panorama is taken: at eye height beside the table, 1.5 m from the middle of its top.
    pub capture_position: Vec3,
    /// A view from the capture point onto the table top: degrees to the right of −Z.
    pub view_yaw: f32,
    /// That view's degrees up.
    pub view_pitch: f32,
    /// That view's vertical field of view in degrees, for a square or wider picture.
    pub view_vfov: f32,
    /// Virtual objects on the table top, clear of each other and of the things already there.
    pub objects: Vec<RoomObject>,
}

impl Room {
    /// Builds the room. Always the same, to the bit.
    pub fn new() -> Self {
        let mut b = build::Builder::default();
        let window_materials = shell::add(&mut b);
        furniture::add(&mut b);
        Self {
            mesh: b.mesh,
            window_materials,
            capture_position: Vec3::new(0.50, 1.55, 1.15),
            view_yaw: -25.0,
            view_pitch: -32.0,
            view_vfov: 42.0,
            objects: objects::all(),
        }
    }
}

impl Default for Room {
    fn default() -> Self {
        Self::new()
    }
}
