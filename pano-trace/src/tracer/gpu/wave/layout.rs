//! The kernels of the tracers over captured radiance: their shader, what they bind, and what pixels under way take in memory.

use super::super::scene::{VIEW, View};
use super::super::{AIM, WALK};
use crate::bsdf::gpu::{BSDF, DIRECTIONS};
use crate::bvh::gpu::{RAY, TRAVERSAL};
use crate::cone::CONES;
use crate::objects::gpu::OBJECTS;
use crate::prt::gpu::{Field, MARCHING};
use crate::world::captured::gpu::{CAPTURED, World};
use crate::world::gpu::ENVIRONMENT;
use bytemuck::Zeroable;
use glam::Vec3;
use pano_core::distribution::gpu::DISTRIBUTION;
use pano_core::gpu::{COLOR, Constant, IMAGE, Layout, NUMBER, Piece, RANDOM, Rows, SPHERE, Shader, Specialization, WORDS};

pano_core::uniform! {
    /// `Wave` of the shader.
    pub(crate) struct Wave {
        pub(super) rows: Rows,
        pub(super) view: View,
        pub(super) world: World,
        pub(super) field: Field,
        pub(super) bounces: u32,
        pub(super) samples: u32,
        pub(super) turn: u32,
        pub(super) most_waiting: u32,
        pub(super) clusters: [u32; 2],
        pub(super) lights: [u32; 2],
    }
}

pano_core::uniform! {
    /// `Quest` of the shader.
    pub(crate) struct Quest {
        pub(super) origin: Vec3,
        pub(super) limit: f32,
        pub(super) direction: Vec3,
        pub(super) asks: u32,
        pub(super) goal: Vec3,
        pub(super) aimed: u32,
    }
}

pano_core::uniform! {
    /// `Told` of the shader.
    pub(crate) struct Told {
        pub(super) position: Vec3,
        pub(super) t: f32,
        pub(super) normal: Vec3,
        pub(super) what: u32,
        pub(super) radiance: Vec3,
        pub(super) pdf: f32,
    }
}

/// Bits of [`Told::what`]: there is a surface, and it is only assumed.
pub(super) const REAL_EXISTS: u32 = 1;
pub(super) const REAL_HIDDEN: u32 = 2;

pano_core::uniform! {
    /// `Asked` of the shader. What is between the question and the answer is none of the host's.
    pub(crate) struct Asked {
        pub(super) quest: Quest,
        object: [u32; 8],
        way: [u32; 8],
        met: [u32; 12],
        pub(super) told: Told,
    }
}

impl Asked {
    /// A question without an answer.
    pub(super) fn of(quest: Quest) -> Self {
        Self { quest, ..Zeroable::zeroed() }
    }
}

pano_core::uniform! {
    /// `Point` of the shader; only its size matters here.
    pub(crate) struct Point {
        x: [u32; 3],
        stage: u32,
        normal: [u32; 3],
        cone_rate: u32,
        scale: [u32; 3],
        light_rate: u32,
        u: [u32; 4],
        lights: u32,
        taken: u32,
        share: u32,
        cosine_rate: u32,
        bounces: [u32; 4],
    }
}

pano_core::uniform! {
    /// `Lane` of the shader; only its size matters here.
    pub(crate) struct Lane {
        total: [u32; 3],
        job: u32,
        numbers: [u32; 3],
        number: u32,
        path: [u32; 12],
        light: [u32; 12],
        point: Point,
        mirror: [u32; 8],
        waiting: u32,
        shows_object: u32,
        has_later: u32,
        pad: u32,
        position: [u32; 3],
        surface: u32,
        normal: [u32; 3],
        pad1: u32,
        radiance: [u32; 3],
        pad2: u32,
    }
}

pano_core::uniform! {
    /// `Relit` of the shader; only its size matters here.
    pub(crate) struct Relit {
        start: [u32; 3],
        pair: u32,
        normal: [u32; 3],
        second: u32,
        own: [u32; 3],
        aimed: u32,
        scale: [u32; 3],
        pad1: u32,
        received: [u32; 3],
        pad2: u32,
        goal: [u32; 3],
        pad3: u32,
    }
}

/// `wave.wgsl`, with what comes before it.
pub static SHADER: Shader = Shader {
    name: "wave",
    pieces: &[
        NUMBER,
        SPHERE,
        IMAGE,
        RANDOM,
        WORDS,
        COLOR,
        DISTRIBUTION,
        TRAVERSAL,
        RAY,
        MARCHING,
        DIRECTIONS,
        CONES,
        BSDF,
        OBJECTS,
        ENVIRONMENT,
        CAPTURED,
        VIEW,
        AIM,
        WALK,
        Piece {
            text: include_str!("wave.wgsl"),
            constants: || vec![Constant::u32("REAL_EXISTS", REAL_EXISTS), Constant::u32("REAL_HIDDEN", REAL_HIDDEN)],
        },
    ],
    // Of the many combinations the ends: each method with all effects, and with none.
    specializations: &[
        Specialization { entry: "sight", constants: &[] },
        Specialization { entry: "encounter", constants: &[] },
        Specialization { entry: "march", constants: &[] },
        Specialization { entry: "tell", constants: &[] },
        Specialization { entry: "tell", constants: LEAST },
        Specialization { entry: "start", constants: &[] },
        Specialization { entry: "start", constants: LEAST },
        Specialization { entry: "begin", constants: &[] },
        Specialization { entry: "advance", constants: &[("METHOD", 0.0)] },
        Specialization { entry: "advance", constants: &[("METHOD", 1.0)] },
        Specialization { entry: "advance", constants: &[("METHOD", 2.0)] },
        Specialization { entry: "advance", constants: &[("METHOD", 3.0), ("POINTS", 0.0)] },
        Specialization { entry: "advance", constants: LEAST },
    ],
};

/// A scene without any effect that can be left out.
const LEAST: &[(&str, f64)] = &[
    ("GLOSS", 0.0),
    ("BODIES", 0.0),
    ("LIT", 0.0),
    ("EMITTERS", 0.0),
    ("TEXTURES", 0.0),
    ("SECOND_ORDER", 0.0),
    ("EVERYWHERE", 1.0),
];

/// A kernel: its entry point, what it binds, and on which of the scene's constants it depends (`None`: all).
pub(super) type Entry = (&'static str, &'static [u32], Option<&'static [&'static str]>);

pub(super) const SIGHT: Entry = ("sight", &[ASKED], NONE);
pub(super) const ENCOUNTER: Entry = ("encounter", &[1, 2, 3, ASKED, COUNTS], NONE);
pub(super) const MARCH: Entry = ("march", &[ASKED, FIELD, FIELD + 1, FIELD + 2, FIELD + 3], NONE);
pub(super) const TELL: Entry = ("tell", &[4, 5, ASKED, FIELD, FIELD + 1, RELITS], Some(&["LIT"]));
pub(super) const START: Entry = ("start", &[4, PIXELS, ASKED], None);
pub(super) const BEGIN: Entry = ("begin", &[PIXELS, ASKED, LANES], NONE);
pub(super) const ADVANCE: Entry = ("advance", &[4, 5, PIXELS, ASKED, LANES, WAITING, FIELD, FIELD + 1], None);

const NONE: Option<&[&str]> = Some(&[]);
pub(super) const PIXELS: u32 = 6;
pub(super) const ASKED: u32 = 7;
pub(super) const LANES: u32 = 8;
pub(super) const WAITING: u32 = 9;
pub(super) const FIELD: u32 = 10;
pub(super) const RELITS: u32 = 14;
pub(super) const COUNTS: u32 = 15;

/// Structures of the shader.
pub(crate) fn layouts() -> Vec<(&'static Shader, Layout)> {
    let layouts = [Wave::LAYOUT, World::LAYOUT, Field::LAYOUT, Quest::LAYOUT, Told::LAYOUT, Asked::LAYOUT, Point::LAYOUT];
    layouts.into_iter().chain([Lane::LAYOUT, Relit::LAYOUT]).map(|layout| (&SHADER, layout)).collect()
}
