//! What a hit on an object means: position, normals, textures read, scattering.

use super::{Differentials, Neighbours, Placed, interpolate};
use crate::bsdf::{Bsdf, BsdfParams};
use crate::bvh::{InstanceHit, Ray};
use glam::{Vec2, Vec3, Vec4};
use pano_core::material::Texture;
use pano_core::texture::Footprint;

/// What lies behind a surface that lets light in.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Body {
    /// Refractive index, ≥ 1.
    pub ior: f32,
    /// Share of the light that enters, each channel in [0, 1], reflection at the surface not counted.
    pub factors: Vec3,
    /// Share of the surface that is clear, [0, 1]: of it light is reflected without colour.
    pub clear: f32,
    /// A sheet instead of a body: light passes straight through.
    pub thin: bool,
    /// GGX width of the surface, [0, 1].
    pub alpha: f32,
    /// What the body takes away from the light.
    pub absorption: Absorption,
}

/// Absorption along a way by Beer's law.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Absorption {
    /// Colour of white light after `distance`, [0, 1].
    pub color: Vec3,
    /// Metres; infinite for a clear body.
    pub distance: f32,
}

impl Absorption {
    /// None at all.
    pub const NONE: Self = Self { color: Vec3::ONE, distance: f32::INFINITY };

    /// What is left after `t` metres, [0, 1]. A channel of 0 stays 0 at any distance > 0.
    pub fn transmittance(&self, t: f32) -> Vec3 {
        if self.distance.is_finite() && self.distance > 0.0 {
            self.color.clamp(Vec3::ZERO, Vec3::ONE).powf(t / self.distance)
        } else {
            Vec3::ONE
        }
    }
}

/// A point of a virtual object's surface, seen along a ray.
#[derive(Clone, Copy, Debug)]
pub struct Surface<'a> {
    /// World position, interpolated between the face's vertices.
    pub position: Vec3,
    /// Scattering towards where the ray came from.
    pub bsdf: Bsdf<'a>,
    /// Emitted radiance, from the outside of a face.
    pub emission: Vec3,
    /// What the body that the ray has just crossed left of its light: 1 unless the ray hit the inside of a solid body.
    pub transmittance: Vec3,
    /// Base colour, for filters.
    pub albedo: Vec3,
    /// What the surface lets light into; `None`: nothing.
    pub body: Option<Body>,
    /// The ray came from the side that the geometric normal points to.
    pub outside: bool,
    /// What the ray's pixel covers here, if that was asked.
    pub neighbours: Option<Neighbours>,
}

impl<'a> Surface<'a> {
    pub(super) fn new(placed: &'a Placed, ray: &Ray, hit: &InstanceHit, beam: Option<(&Differentials, u32)>) -> Self {
        let mesh = &placed.mesh.mesh;
        let h = &hit.hit;
        let indices = mesh.triangles[h.triangle as usize];
        let corners = placed.corners(h.triangle);
        let position = placed.world_from_mesh.transform_point3(interpolate(corners, h.barycentric));
        let face = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
        // The inverse transpose keeps outward normals outward, mirrored or not.
        let to_world = |n: Vec3| Vec3::from(placed.world_from_normal * glam::Vec3A::from(n));
        let geometric = to_world(face).try_normalize().unwrap_or(-ray.direction);
        let mut normal = if mesh.normals.is_empty() {
            geometric
        } else {
            let n = interpolate(indices.map(|v| mesh.normals[v as usize]), h.barycentric);
            let n = to_world(n).try_normalize().unwrap_or(geometric);
            if n.dot(geometric) < 0.0 { -n } else { n }
        };
        let compiled = &placed.materials[placed.material_index(h.triangle)];
        let m = &compiled.material;
        let uv = if mesh.uvs.is_empty() { Vec2::ZERO } else { interpolate(indices.map(|v| mesh.uvs[v as usize]), h.barycentric) };
        let spread = beam.map(|(beam, most)| {
            let mut neighbours = beam.on_plane(ray, h.t, geometric);
            let axes = spread(placed, indices, (corners, h.barycentric), normal, &mut neighbours);
            (neighbours, axes.map(|axes| Footprint { axes, max_anisotropy: most }))
        });
        let look = |texture: &Texture| -> Vec4 {
            match spread.and_then(|(_, footprint)| footprint) {
                Some(footprint) => texture.sample_over(uv, &footprint),
                None => texture.sample(uv),
            }
        };
        if let Some(texture) = &m.normal_texture
            && let Some((tangent, bitangent)) = tangents(placed, indices, corners)
        {
            let t = look(texture).truncate() * 2.0 - 1.0;
            let bent = tangent * (t.x * m.normal_scale) + bitangent * (t.y * m.normal_scale) + normal * t.z;
            normal = bent.try_normalize().unwrap_or(normal);
        }
        let base_color = match &m.base_color_texture {
            Some(texture) => m.base_color * look(texture).truncate(),
            None => m.base_color,
        };
        let (mut metallic, mut roughness) = (m.metallic, m.roughness);
        if let Some(texture) = &m.metallic_roughness_texture {
            let t = look(texture);
            (metallic, roughness) = (metallic * t.z, roughness * t.y);
        }
        let outside = geometric.dot(ray.direction) < 0.0;
        let emission = match &m.emissive_texture {
            _ if !outside => Vec3::ZERO,
            Some(texture) => m.emissive * look(texture).truncate(),
            None => m.emissive,
        };
        let solid = m.transmission > 0.0 && !m.thin;
        let absorption = Absorption { color: m.attenuation_color, distance: m.attenuation_distance };
        let transmittance = if solid && !outside { absorption.transmittance(h.t) } else { Vec3::ONE };
        let params = BsdfParams {
            base_color,
            metallic: metallic.clamp(0.0, 1.0),
            alpha: (roughness * roughness).clamp(0.0, 1.0),
            specular: m.specular,
            specular_color: m.specular_color,
            ior: m.ior,
            transmission: m.transmission,
            thin: m.thin,
            coat: compiled.coat.as_deref(),
        };
        let bsdf = Bsdf::new(&params, geometric, normal, -ray.direction);
        let clear = m.transmission * (1.0 - params.metallic);
        let body = (clear > 0.0).then(|| Body {
            ior: m.ior,
            factors: base_color * clear,
            clear,
            thin: m.thin,
            alpha: params.alpha,
            absorption: if solid { absorption } else { Absorption::NONE },
        });
        Self { position, bsdf, emission, transmittance, albedo: base_color, body, outside, neighbours: spread.map(|s| s.0) }
    }
}

/// What a pixel that covers `neighbours.position` of a face covers of its texture; `None` where there is none or the face has no
/// area. Sets how the interpolated unit `normal` changes.
fn spread(
    placed: &Placed,
    indices: [u32; 3],
    (corners, barycentric): ([Vec3; 3], Vec2),
    normal: Vec3,
    neighbours: &mut Neighbours,
) -> Option<[Vec2; 2]> {
    let mesh = &placed.mesh.mesh;
    let edges = [corners[1] - corners[0], corners[2] - corners[0]].map(|e| placed.world_from_mesh.transform_vector3(e));
    let [aa, ab, bb] = [edges[0].length_squared(), edges[0].dot(edges[1]), edges[1].length_squared()];
    let det = aa * bb - ab * ab;
    // Weights of the second and third vertex along a step on the face.
    let weights = neighbours.position.map(|step| {
        let (a, b) = (edges[0].dot(step), edges[1].dot(step));
        Vec2::new(bb * a - ab * b, aa * b - ab * a) / det
    });
    if !weights.iter().all(|w| w.is_finite()) {
        return None;
    }
    if !mesh.normals.is_empty() {
        let normals = indices.map(|v| placed.world_from_normal * glam::Vec3A::from(mesh.normals[v as usize]));
        let mean = Vec3::from(interpolate(normals, barycentric));
        let side = if mean.dot(normal) < 0.0 { -1.0 } else { 1.0 };
        neighbours.normal = weights.map(|w| {
            let change = Vec3::from((normals[1] - normals[0]) * w.x + (normals[2] - normals[0]) * w.y) * side;
            let turned = (change - normal * change.dot(normal)) / mean.length();
            if turned.is_finite() { turned } else { Vec3::ZERO }
        });
    }
    let uvs = (!mesh.uvs.is_empty()).then(|| indices.map(|v| mesh.uvs[v as usize]))?;
    Some(weights.map(|w| (uvs[1] - uvs[0]) * w.x + (uvs[2] - uvs[0]) * w.y))
}

/// World-space directions in which u and −v grow (glTF's tangent frame), of unit length; `None` where the mapping is
/// degenerate.
fn tangents(placed: &Placed, indices: [u32; 3], corners: [Vec3; 3]) -> Option<(Vec3, Vec3)> {
    let uvs = &placed.mesh.mesh.uvs;
    if uvs.is_empty() {
        return None;
    }
    let [a, b, c] = indices.map(|v| uvs[v as usize]);
    let (d1, d2) = (b - a, c - a);
    let (e1, e2) = (corners[1] - corners[0], corners[2] - corners[0]);
    let det = d1.perp_dot(d2);
    let world = |v: Vec3| placed.world_from_mesh.transform_vector3(v).try_normalize();
    let (tangent, bitangent) = ((e1 * d2.y - e2 * d1.y) / det, (e1 * d2.x - e2 * d1.x) / det);
    Some((world(tangent)?, world(bitangent)?)).filter(|_| det.abs() > 1e-20)
}
