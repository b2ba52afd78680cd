//! The kernels' shader, what they bind, and what pixels take in memory.

use super::super::gbuffer::{COVER_POINTS, SHOWN_WITHIN};
use super::super::trace::{MIRROR_RAYS, MOST_THINNING};
use crate::objects::gpu::MOVE_WORDS;
use crate::prt::gpu::Field;
use crate::tracer::gpu::scene::View;
use crate::tracer::gpu::wave::follow::{self, ASKED, Entry, FIELD, GLOSSES, NONE, RELITS, UPDATES, pieces_that_follow};
use crate::tracer::gpu::{AIM, PATHS};
use crate::world::captured::gpu::World;
use bytemuck::Zeroable;
use glam::Vec3;
use pano_core::gpu::{Constant, Layout, Piece, Rows, Shader, Specialization};

pano_core::uniform! {
    /// `Iprt` of the shader.
    pub(crate) struct Iprt {
        pub(super) rows: Rows,
        pub(super) view: View,
        pub(super) world: World,
        pub(super) field: Field,
        pub(super) bounces: u32,
        pub(super) samples: u32,
        pub(super) turn: u32,
        pub(super) attempts: u32,
        pub(super) clusters: [u32; 2],
        pub(super) lights: [u32; 2],
        pub(super) update_size: [u32; 2],
        pub(super) view_size: [u32; 2],
        pub(super) earlier: View,
        pub(super) has_earlier: u32,
        pub(super) at_capture: u32,
        pub(super) moves: u32,
        pub(super) virtual_pass: u32,
    }
}

pano_core::uniform! {
    /// `Texel` of the shader.
    pub(crate) struct Texel {
        pub(super) normal: Vec3,
        pub(super) depth: f32,
        pub(super) position: Vec3,
        pub(super) thing: u32,
        pub(super) albedo: Vec3,
        pub(super) mirrors: u32,
        pub(super) previous: [f32; 2],
        pub(super) known: u32,
        pub(super) previous_depth: f32,
    }
}

pano_core::uniform! {
    /// `Estimate` of the shader.
    pub(crate) struct Estimate {
        pub(super) real: Vec3,
        pub(super) real_squares: f32,
        pub(super) change: Vec3,
        pub(super) change_squares: f32,
        pub(super) mirror: Vec3,
        pub(super) mirror_rays: u32,
        pub(super) mirrored: Vec3,
        pub(super) count: u32,
        pub(super) mirrored_mixed: Vec3,
        pub(super) samples: u32,
        pub(super) touched: u32,
        pub(super) rays: u32,
        pad0: u32,
        pad1: u32,
    }
}

impl Estimate {
    /// Before the first sample.
    pub(super) fn before(wanted: bool) -> Self {
        Self { samples: u32::from(wanted), ..Self::zeroed() }
    }
}

pano_core::uniform! {
    /// `EstimateLane` of the shader; only its size matters here.
    pub(crate) struct EstimateLane {
        total: [u32; 3],
        job: u32,
        numbers: [u32; 3],
        number: u32,
        path: [u32; 12],
        light: [u32; 12],
        place: [u32; 3],
        attempt: u32,
        normal: [u32; 3],
        purpose: u32,
        direction: [u32; 3],
        pad0: u32,
        kept: [u32; 3],
        pad1: u32,
    }
}

pano_core::uniform! {
    /// `ViewTexel` of the shader.
    pub(crate) struct ViewTexel {
        pub(super) ratio: Vec3,
        pub(super) depth: f32,
        pub(super) gloss: [f32; 2],
        pub(super) real: u32,
        pub(super) pad: u32,
    }
}

/// `iprt.wgsl`, `update.wgsl`, `gbuffer.wgsl` and `estimate.wgsl`, with what comes before them.
pub static SHADER: Shader = Shader {
    name: "iprt",
    pieces: pieces_that_follow![
        AIM,
        PATHS,
        Piece {
            text: concat!(
                include_str!("iprt.wgsl"),
                include_str!("update.wgsl"),
                include_str!("gbuffer.wgsl"),
                include_str!("estimate.wgsl"),
            ),
            constants: || {
                vec![
                    Constant::u32("COVER_POINTS", COVER_POINTS),
                    Constant::f32("SHOWN_WITHIN", SHOWN_WITHIN),
                    Constant::u32("MIRROR_RAYS", MIRROR_RAYS),
                    Constant::u32("MOST_THINNING_OF_IRRADIANCE", MOST_THINNING),
                    Constant::u32("MOVE_WORDS", MOVE_WORDS),
                ]
            },
        },
    ],
    // Of the many combinations the ends: all effects, and none.
    specializations: &[
        Specialization { entry: "sight", constants: &[] },
        Specialization { entry: "encounter", constants: &[] },
        Specialization { entry: "march", constants: &[] },
        Specialization { entry: "tell", constants: &[] },
        Specialization { entry: "tell", constants: &[("LIT", 0.0)] },
        Specialization { entry: "gbuffer", constants: FIRST_ORDER },
        Specialization { entry: "gbuffer", constants: LEAST },
        Specialization { entry: "cover", constants: &[] },
        Specialization { entry: "centers", constants: &[] },
        Specialization { entry: "begin", constants: FIRST_ORDER },
        Specialization { entry: "begin", constants: LEAST },
        Specialization { entry: "advance", constants: FIRST_ORDER },
        Specialization { entry: "advance", constants: LEAST },
        Specialization { entry: "update", constants: &[] },
    ],
};

/// The panorama shows the change of surfaces already.
const FIRST_ORDER: &[(&str, f64)] = &[("SECOND_ORDER", 0.0)];

/// A scene without any effect that can be left out.
const LEAST: &[(&str, f64)] =
    &[("SECOND_ORDER", 0.0), ("GLOSS", 0.0), ("BODIES", 0.0), ("LIT", 0.0), ("EMITTERS", 0.0), ("TEXTURES", 0.0)];

pub(super) const GBUFFER: Entry = ("gbuffer", &[4, ASKED, TEXELS], Some(&["GLOSS", "BODIES", "TEXTURES"]));
pub(super) const COVER: Entry = ("cover", &[ASKED, COVERS], NONE);
pub(super) const CENTERS: Entry = ("centers", &[ASKED, ESTIMATES], NONE);
pub(super) const BEGIN: Entry = ("begin", &[4, ASKED, LANES, ESTIMATES], None);
pub(super) const ADVANCE: Entry = ("advance", &[4, 5, ASKED, LANES, FIELD, FIELD + 1, RELITS, ESTIMATES], None);
pub(super) const UPDATE: Entry = ("update", &[FIELD, FIELD + 1, UPDATES, GLOSSES, VIEW_TEXELS], NONE);

pub(super) const LANES: u32 = 8;
pub(super) const TEXELS: u32 = 17;
pub(super) const COVERS: u32 = 18;
pub(super) const ESTIMATES: u32 = 19;
pub(super) const VIEW_TEXELS: u32 = 20;

/// Structures of the shader.
pub(crate) fn layouts() -> Vec<(&'static Shader, Layout)> {
    let layouts = [Iprt::LAYOUT, View::LAYOUT, World::LAYOUT, Field::LAYOUT, Texel::LAYOUT, Estimate::LAYOUT];
    let layouts = layouts.into_iter().chain([EstimateLane::LAYOUT, ViewTexel::LAYOUT]).chain(follow::LAYOUTS);
    layouts.map(|layout| (&SHADER, layout)).collect()
}
