//! What is printed: the modules of a marker.

use super::detect::kind_of;
use glam::Vec3;
use kornia_apriltag::family::TagFamily;
use pano_core::builtin::primitives;
use pano_core::material::Material;
use pano_core::mesh::Mesh;
use pano_core::{Error, Result};

/// A marker's black and white modules. Coordinates count modules from the top left corner of the square whose corners are
/// found, to the right and down.
#[derive(Clone, Debug)]
pub struct Pattern {
    /// Modules along a side of the square.
    side: i32,
    /// From one module left of and above the square on, row by row: 1 white, 0 black, NaN unknown.
    modules: Vec<f64>,
}

/// Reflectance of black and white on office paper.
const INK: f32 = 0.04;
const PAPER: f32 = 0.85;
/// Modules around the square that are known: its rim.
const RIM: i32 = 1;

impl Pattern {
    /// The marker `id` of a `family`.
    ///
    /// # Errors
    /// [`Error::Argument`] if there is no such family, or no such marker in it.
    pub fn new(family: &str, id: u32) -> Result<Self> {
        let unknown = || Error::argument(format!("markers: `{family}` has no marker {id}"));
        let family = TagFamily::try_from(kind_of(family)?).map_err(|_| unknown())?;
        let code = *family.code_data.get(id as usize).ok_or_else(unknown)?;
        let side = family.width_at_border as i32;
        let border = if family.reversed_border { 1.0 } else { 0.0 };
        let module = |x: i32, y: i32| {
            let is = |i: &usize| (i32::from(family.bit_x[*i]), i32::from(family.bit_y[*i])) == (x, y);
            let from_edge = x.min(y).min(side - 1 - x).min(side - 1 - y);
            match (0..family.nbits).find(is) {
                Some(i) => (code >> (family.nbits - 1 - i) & 1) as f64,
                None if from_edge == 0 => border,
                None if from_edge == -1 => 1.0 - border,
                None => f64::NAN,
            }
        };
        let range = -RIM..side + RIM;
        let modules = range.clone().flat_map(|y| range.clone().map(move |x| (x, y))).map(|(x, y)| module(x, y)).collect();
        Ok(Self { side, modules })
    }

    /// The print as a mesh in the marker's frame, its square of side `size` metres: a face a module, rim included. What is not
    /// known is white.
    pub fn mesh(&self, size: f32) -> Mesh {
        let module = size / self.side as f32;
        let paint = |light: f32| Material::diffuse(Vec3::splat(light));
        let mut mesh = Mesh { materials: vec![paint(INK), paint(PAPER)], ..Mesh::default() };
        let across = self.side + 2 * RIM;
        for (i, white) in self.modules.iter().enumerate() {
            let (x, z) = (i as i32 % across - RIM, i as i32 / across - RIM);
            let corner = Vec3::new(x as f32, 0.0, z as f32) * module - Vec3::new(0.5 * size, 0.0, 0.5 * size);
            let face = primitives::quad(corner, Vec3::Z * module, Vec3::X * module);
            let first = mesh.positions.len() as u32;
            mesh.positions.extend(face.positions);
            mesh.normals.extend(face.normals);
            mesh.triangles.extend(face.triangles.iter().map(|t| t.map(|v| v + first)));
            mesh.material_ids.extend([u32::from(*white != 0.0); 2]);
        }
        mesh
    }

    /// Modules along a side of the square.
    pub fn side(&self) -> f64 {
        f64::from(self.side)
    }

    /// Share of white in a box: NaN where it holds what is not known, such as what is beyond the rim.
    pub fn white(&self, lo: [f64; 2], hi: [f64; 2]) -> f64 {
        let cells = |k: usize| lo[k].floor() as i32..hi[k].ceil().max(lo[k].floor() + 1.0) as i32;
        let overlap = |k: usize, i: i32| (hi[k].min(f64::from(i + 1)) - lo[k].max(f64::from(i))).max(0.0);
        let known = -RIM..self.side + RIM;
        let (mut white, mut all) = (0.0, 0.0);
        for (y, x) in cells(1).flat_map(|y| cells(0).map(move |x| (y, x))) {
            let area = overlap(0, x) * overlap(1, y);
            if !known.contains(&x) || !known.contains(&y) {
                return f64::NAN;
            }
            white += area * self.modules[((y + RIM) * (self.side + 2 * RIM) + x + RIM) as usize];
            all += area;
        }
        if all > 0.0 { white / all } else { self.white(lo, [lo[0] + 1e-9, lo[1] + 1e-9]) }
    }
}
