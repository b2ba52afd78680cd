//! Rays through the hierarchy on the GPU.
//!
//! Departures from the CPU: the trees are binary ones (`obvhs`' BVH2) instead of eight-wide compressed ones, over the same
//! triangles in the same precision; the intersection is the same. All meshes lie in one array of nodes and one of triangles, so
//! that a scene of more than two million triangles, which exceeds a binding, stays on the CPU.

mod batch;
mod flatten;

pub(crate) use batch::{RAY, RayKernel};

use super::{InstanceHit, Ray, Tlas, TriangleHit};
use bytemuck::{Pod, Zeroable};
use glam::{Vec2, Vec3};
use pano_core::gpu::{Constant, Gpu, GpuBuffer, GpuResult, Kernel, NUMBER, Piece, Shader, Specialization};

/// Nodes that may be left for later along one ray, in each of the two trees: their greatest depth.
pub const DEPTH: usize = 64;

/// Rays of one submission: some ten milliseconds of a slow GPU.
const BATCH: usize = 1 << 18;

pano_core::uniform! {
    /// `Node` of the shader: a box, and what is in it.
    pub(crate) struct Node {
        pub(crate) lo: Vec3,
        pub(crate) first: u32,
        pub(crate) hi: Vec3,
        pub(crate) count: u32,
    }
}

pano_core::uniform! {
    /// `Triangle` of the shader.
    pub(crate) struct Triangle {
        pub(crate) v0: Vec3,
        pub(crate) face: u32,
        pub(crate) e1: Vec3,
        pub(crate) pad1: u32,
        pub(crate) e2: Vec3,
        pub(crate) pad2: u32,
        pub(crate) ng: Vec3,
        pub(crate) pad3: u32,
    }
}

pano_core::uniform! {
    /// `Instance` of the shader.
    pub(crate) struct Instance {
        pub(crate) x: [f32; 4],
        pub(crate) y: [f32; 4],
        pub(crate) z: [f32; 4],
        pub(crate) root: u32,
        pub(crate) index: u32,
        pub(crate) kind: u32,
        pub(crate) pad2: u32,
    }
}

pano_core::uniform! {
    /// `Rays` of the shader.
    pub(crate) struct Rays {
        count: u32,
        root: u32,
    }
}

/// `Hit` of the shader.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
struct GpuHit {
    t: f32,
    barycentric: Vec2,
    instance: u32,
    face: u32,
}

/// Kinds of instances: those that let no light through, and those that do.
const OPAQUE_KIND: u32 = 1;
const CLEAR_KIND: u32 = 2;

/// No node, and no instance.
const NOTHING: u32 = u32::MAX;

/// Traversal, for shaders to include; it needs [`NUMBER`].
pub const TRAVERSAL: Piece = Piece {
    text: include_str!("traversal.wgsl"),
    constants: || {
        vec![
            Constant::u32("DEPTH", DEPTH as u32),
            Constant::u32("OPAQUE_KIND", OPAQUE_KIND),
            Constant::u32("CLEAR_KIND", CLEAR_KIND),
        ]
    },
};

/// `rays.wgsl`.
pub static SHADER: Shader = Shader {
    name: "rays",
    pieces: &[NUMBER, RAY, TRAVERSAL, Piece::plain(include_str!("rays.wgsl"))],
    specializations: &[Specialization { entry: "closest", constants: &[] }, Specialization { entry: "any_hit", constants: &[] }],
};

/// Hierarchies in the GPU's memory.
#[derive(Debug)]
pub struct GpuTlas {
    nodes: GpuBuffer,
    triangles: GpuBuffer,
    instances: GpuBuffer,
    /// Of each.
    roots: Vec<u32>,
}

impl GpuTlas {
    /// Copies a hierarchy to the GPU, with binary trees.
    ///
    /// # Errors
    /// [`pano_core::gpu::GpuError::TooLarge`] if there are too many triangles, or what has become of the device.
    pub fn new(gpu: &Gpu, tlas: &Tlas) -> GpuResult<Self> {
        Self::new_of_kinds(gpu, &[tlas], |_| false)
    }

    /// Copies several, whose meshes are shared; `clear` says which instances of the first one let light through.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub(crate) fn new_of_kinds(gpu: &Gpu, hierarchies: &[&Tlas], clear: impl Fn(u32) -> bool) -> GpuResult<Self> {
        let mut flat = flatten::flatten(hierarchies);
        let of_the_first = hierarchies.first().map_or(0, |tlas| tlas.instances.len());
        flat.instances[..of_the_first].iter_mut().filter(|i| clear(i.index)).for_each(|i| i.kind = CLEAR_KIND);
        // Nothing can be bound of nothing; nobody looks at it. Faces without an area are in no tree.
        one_at_least(&mut flat.nodes);
        one_at_least(&mut flat.triangles);
        one_at_least(&mut flat.instances);
        Ok(Self {
            nodes: gpu.upload_slice(&flat.nodes)?,
            triangles: gpu.upload_slice(&flat.triangles)?,
            instances: gpu.upload_slice(&flat.instances)?,
            roots: flat.roots,
        })
    }

    /// Where each hierarchy's tree begins, for [`TRAVERSAL`].
    pub(crate) fn roots(&self) -> &[u32] {
        &self.roots
    }

    /// What a shader with [`TRAVERSAL`] binds.
    pub(crate) fn bindings(&self) -> [(u32, &GpuBuffer); 3] {
        [(1, &self.nodes), (2, &self.triangles), (3, &self.instances)]
    }

    /// [`Tlas::intersect`] of each ray.
    ///
    /// # Errors
    /// What has become of the device.
    pub fn intersect(&self, gpu: &Gpu, rays: &[Ray]) -> GpuResult<Vec<Option<InstanceHit>>> {
        let hits: Vec<GpuHit> = self.trace(gpu, "closest", 5, rays)?;
        let hit = |h: GpuHit| InstanceHit {
            instance: h.instance,
            hit: TriangleHit { t: h.t, triangle: h.face, barycentric: h.barycentric },
        };
        Ok(hits.into_iter().map(|h| (h.instance != NOTHING).then(|| hit(h))).collect())
    }

    /// [`Tlas::occluded`] of each ray.
    ///
    /// # Errors
    /// What has become of the device.
    pub fn occluded(&self, gpu: &Gpu, rays: &[Ray]) -> GpuResult<Vec<bool>> {
        let found: Vec<u32> = self.trace(gpu, "any_hit", 6, rays)?;
        Ok(found.into_iter().map(|f| f != 0).collect())
    }

    /// Runs a kernel over the rays; what it writes at `binding`.
    fn trace<T: Pod>(&self, gpu: &Gpu, entry: &'static str, binding: u32, rays: &[Ray]) -> GpuResult<Vec<T>> {
        let rays_kernel = RayKernel {
            kernel: Kernel { shader: &SHADER, entry, constants: &[] },
            buffers: &self.bindings(),
            bindings: [4, binding],
            batch: BATCH,
        };
        rays_kernel.run(gpu, |count| Rays { count, root: self.roots[0] }, rays)
    }
}

/// Structures that Rust fills, with the shader that declares each.
pub(crate) fn layouts() -> Vec<(&'static Shader, pano_core::gpu::Layout)> {
    [Node::LAYOUT, Triangle::LAYOUT, Instance::LAYOUT, Rays::LAYOUT].map(|layout| (&SHADER, layout)).to_vec()
}

fn one_at_least<T: Zeroable>(values: &mut Vec<T>) {
    if values.is_empty() {
        values.push(Zeroable::zeroed());
    }
}
