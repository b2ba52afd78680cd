//! The kernels of the tracers over captured radiance: their shader, what they bind, and what pixels under way take in memory.

use super::super::scene::View;
use super::super::{AIM, PATHS, TURNS};
use super::follow::{self, ASKED, Entry, FIELD, STILL, pieces_that_follow};
use crate::prt::gpu::Field;
use crate::world::captured::gpu::World;
use pano_core::gpu::{Layout, Piece, Rows, Shader, Specialization};

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
        pad3: u32,
        path: [u32; 12],
        light: [u32; 12],
        point: Point,
        mirror: [u32; 12],
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

/// `wave.wgsl`, with what comes before it.
pub static SHADER: Shader = Shader {
    name: "wave",
    pieces: pieces_that_follow![AIM, PATHS, TURNS, STILL, Piece::plain(include_str!("wave.wgsl"))],
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
        Specialization { entry: "begin", constants: &[("ADAPTIVE", 0.0)] },
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
    ("ADAPTIVE", 0.0),
];

pub(super) const START: Entry = ("start", &[4, PIXELS, ASKED], None);
pub(super) const BEGIN: Entry = ("begin", &[PIXELS, ASKED, LANES], Some(&["ADAPTIVE"]));
pub(super) const ADVANCE: Entry = ("advance", &[4, 5, PIXELS, ASKED, LANES, WAITING, FIELD, FIELD + 1], None);

pub(super) const PIXELS: u32 = 6;
pub(super) const LANES: u32 = 8;
pub(super) const WAITING: u32 = 9;

/// Structures of the shader.
pub(crate) fn layouts() -> Vec<(&'static Shader, Layout)> {
    let layouts = [Wave::LAYOUT, World::LAYOUT, Field::LAYOUT, Point::LAYOUT, Lane::LAYOUT];
    layouts.into_iter().chain(follow::LAYOUTS).map(|layout| (&SHADER, layout)).collect()
}
