//! Ray tracing for virtual objects in 360° pictures.

pub mod bsdf;
pub mod bvh;
mod cone;
mod directions;
pub mod iprt;
pub mod mr360;
pub mod objects;
pub mod prt;
pub mod rt2ar;
pub mod sparse;
#[cfg(test)]
mod test_scenes;
pub mod tracer;
pub mod world;

/// Every shader of this crate, for the checks that need no GPU.
#[cfg(feature = "gpu")]
pub fn shaders() -> Vec<&'static pano_core::gpu::Shader> {
    vec![
        &sparse::gpu::SHADER,
        &bvh::gpu::SHADER,
        &prt::gpu::SHADER,
        &tracer::gpu::SHADER,
        &tracer::gpu::WAVE,
        &mr360::gpu::SHADER,
        &mr360::gpu::CAPTURED,
        &rt2ar::gpu::SHADER,
        &iprt::gpu::SHADER,
    ]
}

/// Structures that Rust fills for them, with the shader that declares each.
#[cfg(feature = "gpu")]
pub fn layouts() -> Vec<(&'static pano_core::gpu::Shader, pano_core::gpu::Layout)> {
    [
        vec![(&sparse::gpu::SHADER, sparse::gpu::Sparse::LAYOUT)],
        bvh::gpu::layouts(),
        prt::gpu::layouts(),
        tracer::gpu::layouts(),
        mr360::gpu::layouts(),
        rt2ar::gpu::layouts(),
        iprt::gpu::layouts(),
    ]
    .concat()
}
