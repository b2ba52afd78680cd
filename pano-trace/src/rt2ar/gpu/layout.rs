//! The shader's structures and text, and the constants it has from the CPU.

use super::super::media::MAX_NESTED;
use super::super::shade::{BLURRED, LEAST_WEIGHT, LOBE_WIDTH, MAX_CROSSED};
use super::super::shadow::{ALIKE, GOLDEN, REAL_PROBES, SECOND_LOOKS, SECOND_REAL_LOOK};
use super::super::survey::SAME_NORMAL;
use super::tables::LAMPS;
use crate::bsdf::gpu::{BSDF, DIRECTIONS};
use crate::bvh::gpu::TRAVERSAL;
use crate::mr360::gpu::lighting::{Lighting, MAPS};
use crate::objects::gpu::{DIFFERENTIALS, OBJECTS};
use crate::tracer::gpu::QUESTS;
use crate::tracer::gpu::scene::{GpuPixel, VIEW, View};
use crate::world::gpu::{ENVIRONMENT, PROXIES, World};
use glam::Vec3;
use pano_core::distribution::gpu::DISTRIBUTION;
use pano_core::gpu::{COLOR, Constant, IMAGE, Layout, NUMBER, Piece, RANDOM, Rows, SPHERE, Shader, Specialization, WORDS};

pano_core::uniform! {
    /// `Recursion` of the shader.
    pub(crate) struct Recursion {
        pub(super) rows: Rows,
        pub(super) view: View,
        pub(super) world: World,
        pub(super) lighting: Lighting,
        pub(super) clusters: [u32; 2],
        pub(super) samples: u32,
        pub(super) deepest: u32,
        pub(super) levels: u32,
        pub(super) rounds: u32,
        pub(super) shadow_samples: u32,
        pub(super) probes: u32,
        pub(super) patterns: u32,
        pub(super) response: u32,
        pub(super) response_count: u32,
        pub(super) answers: u32,
        pub(super) reflectance_cap: f32,
        pub(super) brightest: f32,
        pub(super) most_anisotropy: u32,
        pub(super) pad: u32,
    }
}

pano_core::uniform! {
    /// `Seen` of the shader: what a pixel has come to.
    pub(crate) struct Seen {
        pub(super) pixel: GpuPixel,
        pub(super) photo: Vec3,
        pub(super) looks: u32,
        pub(super) quiet: u32,
        pub(super) thorough: u32,
        pub(super) due: u32,
        pub(super) bright: u32,
        pub(super) dark: u32,
        pub(super) penumbra: u32,
        pub(super) taken: u32,
        pub(super) shadow_rays: u32,
    }
}

pano_core::uniform! {
    /// `Walk` of the shader, none of the host's.
    pub(crate) struct Walk {
        value: [u32; 3],
        level: u32,
        shadow: [u32; 24],
        numbers: [u32; 3],
        number: u32,
        under_way: u32,
        shows: u32,
        pad0: u32,
        pad1: u32,
    }
}

pano_core::uniform! {
    /// `Held` of the shader.
    pub(crate) struct Held {
        pub(super) seen: Seen,
        pub(super) walk: Walk,
    }
}

pano_core::uniform! {
    /// `Waiting` of the shader; only its size matters here.
    pub(crate) struct Waiting {
        factor: [u32; 3],
        stage: u32,
        direction: [u32; 3],
        depth: u32,
        light: [u32; 3],
        instance: u32,
        t: u32,
        u: u32,
        v: u32,
        face: u32,
        position: [u32; 3],
        surface: u32,
        normal: [u32; 3],
        weight: u32,
        without: [u32; 3],
        pad1: u32,
        irradiance: [u32; 3],
        pad2: u32,
        highlight: [u32; 3],
        pad3: u32,
        dimmed: [u32; 3],
        media: [u32; 1 + 2 * MAX_NESTED],
        beam: [u32; 16],
    }
}

/// Notes of a pixel about each lamp; the third one's first word is what of the lamp reaches the samples.
pub(super) const NOTES: usize = 4;
pub(super) const REACHED: usize = 2;

/// Bodies that rays are in, for shaders to include after [`OBJECTS`].
const MEDIA: Piece =
    Piece { text: include_str!("media.wgsl"), constants: || vec![Constant::u32("MAX_NESTED", MAX_NESTED as u32)] };

/// Shadows, for shaders to include after [`LAMPS`].
const SURVEY: Piece = Piece {
    text: concat!(include_str!("samples.wgsl"), include_str!("survey.wgsl")),
    constants: || {
        vec![
            Constant::f32("ALIKE", ALIKE),
            Constant::f32("GOLDEN", GOLDEN),
            Constant::f32("SAME_NORMAL", SAME_NORMAL),
            Constant::u32("REAL_PROBES", REAL_PROBES as u32),
            Constant::u32("SECOND_LOOKS_BEGIN", SECOND_LOOKS.start as u32),
            Constant::u32("SECOND_LOOKS_END", SECOND_LOOKS.end as u32),
            Constant::u32("SECOND_REAL_LOOK_BEGIN", SECOND_REAL_LOOK.start as u32),
            Constant::u32("SECOND_REAL_LOOK_END", SECOND_REAL_LOOK.end as u32),
            Constant::u32("NOTES", NOTES as u32),
        ]
    },
};

/// Surfaces on the stack and what they ask, for shaders to include after [`SURVEY`].
const RECURSION: Piece = Piece {
    text: concat!(
        include_str!("stack.wgsl"),
        include_str!("object.wgsl"),
        include_str!("real.wgsl"),
        include_str!("recurse.wgsl"),
    ),
    constants: || {
        vec![
            Constant::f32("LEAST_WEIGHT", LEAST_WEIGHT),
            Constant::f32("BLURRED", BLURRED),
            Constant::f32("LOBE_WIDTH", LOBE_WIDTH),
            Constant::u32("MAX_CROSSED", MAX_CROSSED as u32),
        ]
    },
};

/// `trace.wgsl`, with what comes before it.
pub static SHADER: Shader = Shader {
    name: "rt2ar",
    pieces: &[
        NUMBER,
        SPHERE,
        IMAGE,
        RANDOM,
        WORDS,
        COLOR,
        DISTRIBUTION,
        TRAVERSAL,
        DIRECTIONS,
        BSDF,
        OBJECTS,
        DIFFERENTIALS,
        ENVIRONMENT,
        QUESTS,
        PROXIES,
        VIEW,
        MAPS,
        MEDIA,
        LAMPS,
        SURVEY,
        RECURSION,
        Piece::plain(include_str!("trace.wgsl")),
    ],
    // Of the many combinations the ends: all effects, and none; each kind of shadow.
    specializations: &[
        Specialization { entry: "look", constants: &[] },
        Specialization { entry: "look", constants: LEAST },
        Specialization { entry: "trace", constants: &[] },
        Specialization { entry: "trace", constants: &[("FILTERED", 1.0)] },
        Specialization { entry: "trace", constants: &[("SHADOW", 0.0)] },
        Specialization { entry: "trace", constants: &[("SHADOW", 1.0)] },
        Specialization { entry: "trace", constants: LEAST },
        Specialization { entry: "count", constants: &[] },
    ],
};

/// A scene without any effect that can be left out.
const LEAST: &[(&str, f64)] = &[
    ("GLOSS", 0.0),
    ("BODIES", 0.0),
    ("TEXTURES", 0.0),
    ("PROXY_MESHES", 0.0),
    ("FROM_PICTURE", 0.0),
    ("SHADOWS", 0.0),
    ("MIRRORING", 0.0),
];

/// Structures that Rust fills, with the shader that declares each.
pub(crate) fn layouts() -> Vec<(&'static Shader, Layout)> {
    let own = [Recursion::LAYOUT, Seen::LAYOUT, Walk::LAYOUT, Held::LAYOUT, Waiting::LAYOUT];
    let shared = [View::LAYOUT, World::LAYOUT, Lighting::LAYOUT];
    own.into_iter().chain(shared).map(|layout| (&SHADER, layout)).collect()
}
