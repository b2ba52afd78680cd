//! The virtual objects of a frame: meshes placed in the world, their materials, their bounds and what they emit.

mod bounds;
mod differentials;
mod emitters;
#[cfg(feature = "gpu")]
pub(crate) mod gpu;
mod surface;

pub(crate) use bounds::Beam;
pub use bounds::{Ball, MAX_CLUSTERS};
#[cfg(feature = "gpu")]
pub(crate) use bounds::{SURROUNDINGS, WIDEST};
pub use differentials::{Differentials, Neighbours};
pub use emitters::EmitterSample;
pub use surface::{Absorption, Body, Surface};

use crate::bsdf::CoatTable;
use crate::bvh::{Blas, Faces, InstanceHit, Ray, Tlas};
use bounds::{ball_around, boxes_around, clustered};
use emitters::Emitters;
use glam::{Affine3A, Mat3A, Vec2, Vec3};
use pano_core::{material::Material, mesh::Mesh};
use std::sync::Arc;

/// A mesh with its BVH, ready to be placed any number of times.
#[derive(Clone, Debug)]
pub struct PreparedMesh {
    mesh: Mesh,
    blas: Arc<Blas>,
}

impl PreparedMesh {
    /// Builds the BVH of `mesh`.
    ///
    /// # Errors
    /// What [`Mesh::validate`] finds.
    pub fn new(mesh: Mesh) -> pano_core::Result<Self> {
        mesh.validate()?;
        let blas = Arc::new(Blas::build(&mesh.positions, &mesh.triangles));
        Ok(Self { mesh, blas })
    }

    /// The mesh.
    pub fn mesh(&self) -> &Mesh {
        &self.mesh
    }

    /// Its BVH, for placing it.
    pub fn blas(&self) -> &Arc<Blas> {
        &self.blas
    }
}

/// One object: where a mesh stands and what it is made of.
#[derive(Clone, Debug)]
pub struct Placement {
    /// The mesh.
    pub mesh: Arc<PreparedMesh>,
    /// Places it; must be invertible.
    pub world_from_mesh: Affine3A,
    /// Takes the place of the mesh's own materials.
    pub material: Option<Material>,
}

#[derive(Clone, Debug)]
struct CompiledMaterial {
    material: Material,
    coat: Option<Arc<CoatTable>>,
}

#[derive(Clone, Debug)]
struct Placed {
    mesh: Arc<PreparedMesh>,
    world_from_mesh: Affine3A,
    /// Transforms normals: the inverse transpose of the linear part.
    world_from_normal: Mat3A,
    /// −1 where the placement mirrors, which turns faces inside out.
    orientation: f32,
    materials: Vec<CompiledMaterial>,
    /// Any of these lets light through.
    clear: bool,
}

/// The virtual objects of a frame.
#[derive(Clone, Debug)]
pub struct Objects {
    tlas: Tlas,
    placed: Vec<Placed>,
    balls: Vec<Ball>,
    /// Of each object, in the order of the balls.
    boxes: Vec<Vec<[Vec3; 2]>>,
    clusters: Vec<Ball>,
    surroundings: Vec<Ball>,
    emitters: Emitters,
    transmit: bool,
    gloss: bool,
    textured: bool,
}

impl Objects {
    /// Places the objects. Builds the top level of the BVH; the meshes' own are reused.
    pub fn new(placements: &[Placement]) -> Self {
        let tlas = Tlas::build(placements.iter().map(|p| (p.mesh.blas.clone(), p.world_from_mesh)));
        let mut coats: Vec<(f32, Arc<CoatTable>)> = Vec::new();
        let mut compile = |material: &Material| {
            let coated = material.specular > 0.0 && material.metallic < 1.0 && material.transmission < 1.0 && material.ior > 1.0;
            let coat = coated.then(|| match coats.iter().find(|(ior, _)| *ior == material.ior) {
                Some((_, table)) => table.clone(),
                None => {
                    let table = Arc::new(CoatTable::new(material.ior));
                    coats.push((material.ior, table.clone()));
                    table
                }
            });
            CompiledMaterial { material: material.clone(), coat }
        };
        let placed: Vec<Placed> = placements
            .iter()
            .map(|p| {
                let materials: Vec<CompiledMaterial> = match &p.material {
                    Some(material) => vec![compile(material)],
                    None if p.mesh.mesh.materials.is_empty() => vec![compile(&Material::default())],
                    None => p.mesh.mesh.materials.iter().map(&mut compile).collect(),
                };
                Placed {
                    clear: materials.iter().any(|m| m.material.transmission > 0.0),
                    mesh: p.mesh.clone(),
                    world_from_mesh: p.world_from_mesh,
                    world_from_normal: p.world_from_mesh.matrix3.inverse().transpose(),
                    orientation: p.world_from_mesh.matrix3.determinant().signum(),
                    materials,
                }
            })
            .collect();
        let balls: Vec<Ball> = placed.iter().map(ball_around).collect();
        let boxes = placed.iter().map(boxes_around).collect();
        let clusters = clustered(&balls);
        let surroundings = clusters.iter().map(Ball::surroundings).collect();
        let emitters = Emitters::new(&placed);
        let transmit = placed.iter().any(|p| p.clear);
        let glossy = |m: &CompiledMaterial| m.material.metallic > 0.0 || m.coat.is_some();
        let gloss = placed.iter().flat_map(|p| &p.materials).any(glossy);
        let textures = |m: &Material| {
            [&m.base_color_texture, &m.metallic_roughness_texture, &m.emissive_texture, &m.normal_texture]
                .iter()
                .any(|texture| texture.is_some())
        };
        let textured = placed.iter().flat_map(|p| &p.materials).any(|m| textures(&m.material));
        Self { tlas, placed, balls, boxes, clusters, surroundings, emitters, transmit, gloss, textured }
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.placed.is_empty()
    }

    /// A ball around each object.
    pub fn balls(&self) -> &[Ball] {
        &self.balls
    }

    /// At most [`MAX_CLUSTERS`] balls that hold all objects.
    pub fn clusters(&self) -> &[Ball] {
        &self.clusters
    }

    /// Larger balls around [`Self::clusters`], in which most of what the objects change lies.
    pub(crate) fn surroundings(&self) -> &[Ball] {
        &self.surroundings
    }

    /// Whether the bounds of any object reach into `beam`.
    pub(crate) fn may_be_in(&self, beam: &Beam) -> bool {
        self.balls.iter().zip(&self.boxes).any(|(ball, boxes)| beam.may_meet(ball, boxes))
    }

    /// The nearest object along the ray.
    #[inline]
    pub fn intersect(&self, ray: &Ray) -> Option<InstanceHit> {
        self.tlas.intersect(ray)
    }

    /// The nearest object along the ray from `t_min` on.
    #[inline]
    pub fn intersect_beyond(&self, ray: &Ray, t_min: f32) -> Option<InstanceHit> {
        self.tlas.intersect_beyond(ray, t_min)
    }

    /// Whether an object lies on the ray.
    #[inline]
    pub fn occluded(&self, ray: &Ray) -> bool {
        self.tlas.occluded(ray)
    }

    /// Whether any object lets light through, at least in part.
    pub fn transmit(&self) -> bool {
        self.transmit
    }

    /// Whether an object lets light through anywhere.
    #[cfg(feature = "gpu")]
    pub(crate) fn lets_through(&self, instance: u32) -> bool {
        self.placed[instance as usize].clear
    }

    /// Whether an object that lets no light through anywhere lies on the ray.
    #[inline]
    pub fn opaque_on(&self, ray: &Ray) -> bool {
        self.tlas.occluded_by(ray, |i| !self.placed[i as usize].clear)
    }

    /// The faces along the ray of the objects that let light through.
    #[inline]
    pub fn clear_on<'a>(&'a self, ray: &'a Ray) -> Faces<'a, impl Fn(u32) -> bool + 'a> {
        self.tlas.faces_among(ray, |i| self.placed[i as usize].clear)
    }

    /// Whether any surface reflects other than diffusely.
    pub(crate) fn gloss(&self) -> bool {
        self.gloss
    }

    /// Whether any object shines.
    #[inline]
    pub fn emit(&self) -> bool {
        !self.emitters.is_empty()
    }

    /// A point on a shining face, seen from `from`.
    pub fn sample_emitter(&self, from: Vec3, u: [f32; 4]) -> Option<EmitterSample> {
        self.emitters.sample(from, u)
    }

    /// Density per steradian with which [`Self::sample_emitter`] finds the point that `ray` hit.
    pub fn emitter_pdf(&self, ray: &Ray, hit: &InstanceHit) -> f32 {
        self.emitters.pdf(ray, hit)
    }

    /// Where the point of object `instance` that is at `position` now was among the `earlier` objects; `None` if there was no
    /// such object of the same mesh.
    pub fn was_at(&self, instance: u32, position: Vec3, earlier: &Self) -> Option<Vec3> {
        let (now, then) = (self.placed.get(instance as usize)?, earlier.placed.get(instance as usize)?);
        let on_mesh = now.world_from_mesh.inverse().transform_point3(position);
        Arc::ptr_eq(&now.mesh, &then.mesh).then(|| then.world_from_mesh.transform_point3(on_mesh))
    }

    /// Whether these are the objects of `earlier`, where they were.
    pub fn stand_as(&self, earlier: &Self) -> bool {
        let same =
            |now: &Placed, then: &Placed| Arc::ptr_eq(&now.mesh, &then.mesh) && now.world_from_mesh == then.world_from_mesh;
        self.placed.len() == earlier.placed.len() && self.placed.iter().zip(&earlier.placed).all(|(now, then)| same(now, then))
    }

    /// Everything about the surface at a hit.
    #[inline]
    pub fn surface(&self, ray: &Ray, hit: &InstanceHit) -> Surface<'_> {
        Surface::new(&self.placed[hit.instance as usize], ray, hit, None)
    }

    /// The same, textures averaged over what the ray's `beam` covers; of textures along the longer axis at most
    /// `max_anisotropy` times.
    #[inline]
    pub fn surface_over(&self, ray: &Ray, hit: &InstanceHit, beam: &Differentials, max_anisotropy: u32) -> Surface<'_> {
        Surface::new(&self.placed[hit.instance as usize], ray, hit, Some((beam, max_anisotropy)))
    }

    /// Whether any object has a texture.
    pub fn textured(&self) -> bool {
        self.textured
    }
}

impl Placed {
    fn material_index(&self, triangle: u32) -> usize {
        let id = self.mesh.mesh.material_ids.get(triangle as usize).copied().unwrap_or(0) as usize;
        id.min(self.materials.len() - 1)
    }

    fn corners(&self, triangle: u32) -> [Vec3; 3] {
        self.mesh.mesh.triangles[triangle as usize].map(|v| self.mesh.mesh.positions[v as usize])
    }
}

/// Barycentric mean of per-vertex values.
#[inline]
fn interpolate<T>(values: [T; 3], w: Vec2) -> T
where
    T: std::ops::Mul<f32, Output = T> + std::ops::Add<Output = T>,
{
    let [a, b, c] = values;
    a * (1.0 - w.x - w.y) + b * w.x + c * w.y
}

#[cfg(test)]
mod tests;
