//! Every shader of the workspace, and one that lets tests ask the shared text.

use pano_core::gpu::{IMAGE, Layout, NUMBER, Piece, RANDOM, Rows, SPHERE, Shader, Specialization};
use pano_trace::bsdf::gpu::{BSDF, DIRECTIONS};

/// `probe.wgsl`: the shared functions on numbers of a test's choice.
pub static PROBE: Shader = Shader {
    name: "probe",
    pieces: &[NUMBER, SPHERE, IMAGE, RANDOM, Piece::plain(include_str!("probe.wgsl"))],
    specializations: &[
        Specialization { entry: "angles", constants: &[] },
        Specialization { entry: "directions", constants: &[] },
        Specialization { entry: "finite", constants: &[] },
        Specialization { entry: "random", constants: &[] },
    ],
};

/// `bsdf_probe.wgsl`: scattering at surfaces of a test's choice.
pub static BSDF_PROBE: Shader = Shader {
    name: "bsdf_probe",
    pieces: &[NUMBER, DIRECTIONS, BSDF, Piece::plain(include_str!("bsdf_probe.wgsl"))],
    specializations: &[
        Specialization { entry: "scatter", constants: &[] },
        Specialization { entry: "scatter", constants: &[("GLOSS", 0.0), ("BODIES", 0.0)] },
    ],
};

/// All shaders.
pub fn all() -> Vec<&'static Shader> {
    [
        vec![&PROBE, &BSDF_PROBE],
        pano_core::gpu::shaders(),
        pano_light::shaders(),
        pano_trace::shaders(),
        pano_denoise::shaders(),
        pano_compose::shaders(),
    ]
    .concat()
}

/// Structures that Rust fills, with a shader that declares each.
pub fn layouts() -> Vec<(&'static Shader, Layout)> {
    [
        vec![(&PROBE, Rows::LAYOUT)],
        pano_core::gpu::layouts(),
        pano_light::layouts(),
        pano_trace::layouts(),
        pano_denoise::layouts(),
        pano_compose::layouts(),
    ]
    .concat()
}
