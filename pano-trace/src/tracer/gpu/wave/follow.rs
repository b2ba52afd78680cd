//! Rays under way over captured radiance: the kernels that answer them in turns, and what a ray takes in memory.

use bytemuck::Zeroable;
use glam::Vec3;
use pano_core::gpu::{Constant, Gpu, GpuBuffer, GpuResult, Kernel, Layout, Piece, Rows, Shader};
use pano_core::progress::Progress;

/// Turns after which the rays under way are counted, at most: turns in which there are none cost little.
const TURNS: usize = 16;

/// `follow.wgsl`, for shaders to include after [`crate::tracer::gpu::QUESTS`]. They specialise its four entry points.
pub(crate) const FOLLOW: Piece = Piece {
    text: include_str!("follow.wgsl"),
    constants: || vec![Constant::u32("REAL_EXISTS", REAL_EXISTS), Constant::u32("REAL_HIDDEN", REAL_HIDDEN)],
};

/// For shaders to include that know of no change of the panorama.
pub(crate) const STILL: Piece = Piece::plain(include_str!("still.wgsl"));

/// The pieces of a shader whose kernels send rays into captured radiance: what comes before [`FOLLOW`], it, and their own.
macro_rules! pieces_that_follow {
    ($($own:expr),+ $(,)?) => {
        &[
            pano_core::gpu::NUMBER,
            pano_core::gpu::SPHERE,
            pano_core::gpu::IMAGE,
            pano_core::gpu::RANDOM,
            pano_core::gpu::WORDS,
            pano_core::gpu::COLOR,
            pano_core::distribution::gpu::DISTRIBUTION,
            $crate::bvh::gpu::TRAVERSAL,
            $crate::bvh::gpu::RAY,
            $crate::prt::gpu::MARCHING,
            $crate::bsdf::gpu::DIRECTIONS,
            $crate::cone::CONES,
            $crate::bsdf::gpu::BSDF,
            $crate::objects::gpu::OBJECTS,
            $crate::world::gpu::ENVIRONMENT,
            $crate::world::captured::gpu::CAPTURED,
            $crate::tracer::gpu::scene::VIEW,
            $crate::tracer::gpu::QUESTS,
            $crate::tracer::gpu::wave::follow::FOLLOW,
            $($own),+
        ]
    };
}
pub(crate) use pieces_that_follow;

pano_core::uniform! {
    /// `Quest` of the shader.
    pub(crate) struct Quest {
        pub(crate) origin: Vec3,
        pub(crate) limit: f32,
        pub(crate) direction: Vec3,
        pub(crate) asks: u32,
        pub(crate) goal: Vec3,
        pub(crate) aimed: u32,
    }
}

pano_core::uniform! {
    /// `Told` of the shader.
    pub(crate) struct Told {
        pub(crate) position: Vec3,
        pub(crate) t: f32,
        pub(crate) normal: Vec3,
        pub(crate) what: u32,
        radiance: Vec3,
        pub(crate) pdf: f32,
        pub(crate) light: Vec3,
        pad: u32,
    }
}

/// Bits of [`Told::what`]: there is a surface, and it is only assumed.
pub(super) const REAL_EXISTS: u32 = 1;
pub(super) const REAL_HIDDEN: u32 = 2;

pano_core::uniform! {
    /// `Asked` of the shader. What is between the question and the answer is none of the host's.
    pub(crate) struct Asked {
        pub(crate) quest: Quest,
        object: [u32; 8],
        way: [u32; 8],
        met: [u32; 12],
        pub(crate) told: Told,
    }
}

impl Asked {
    /// A question without an answer.
    pub(crate) fn of(quest: Quest) -> Self {
        Self { quest, ..Zeroable::zeroed() }
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
        gloss: u32,
        received: [u32; 3],
        most: u32,
        goal: [u32; 3],
        pad2: u32,
        position: [u32; 3],
        pad3: u32,
        before: [u32; 3],
        changed: u32,
    }
}

/// Structures of [`FOLLOW`].
pub(crate) const LAYOUTS: [Layout; 4] = [Quest::LAYOUT, Told::LAYOUT, Asked::LAYOUT, Relit::LAYOUT];

/// A kernel: its entry point, what it binds, and on which of the scene's constants it depends (`None`: all).
pub(crate) type Entry = (&'static str, &'static [u32], Option<&'static [&'static str]>);

/// Rays through the pixels' centres.
pub(crate) const SIGHT: Entry = ("sight", &[ASKED], NONE);
const ENCOUNTER: Entry = ("encounter", &[1, 2, 3, ASKED, COUNTS], NONE);
const MARCH: Entry = ("march", &[ASKED, FIELD, FIELD + 1, FIELD + 2, FIELD + 3], NONE);
const TELL: Entry = ("tell", &[4, 5, ASKED, FIELD, FIELD + 1, RELITS, UPDATES, GLOSSES], Some(&["LIT"]));

pub(crate) const NONE: Option<&[&str]> = Some(&[]);
pub(crate) const ASKED: u32 = 7;
/// The first of the depth field's four.
pub(crate) const FIELD: u32 = 10;
pub(crate) const RELITS: u32 = 14;
const COUNTS: u32 = 15;
/// What objects have changed of the panorama, of shaders that know it: ratio and gloss.
pub(crate) const UPDATES: u32 = 16;
pub(crate) const GLOSSES: u32 = 21;

/// A shader with what its kernels share: constants of the scene, buffers, rows.
pub(crate) struct Kernels<'a> {
    pub(crate) gpu: &'a Gpu,
    pub(crate) shader: &'static Shader,
    pub(crate) constants: &'a [(&'static str, f64)],
    pub(crate) buffers: Vec<(u32, &'a GpuBuffer)>,
    pub(crate) rows: Rows,
}

impl Kernels<'_> {
    /// Runs a kernel once.
    pub(crate) fn run(&self, entry: Entry, uniform: &[u8]) -> GpuResult<()> {
        self.run_with(entry, uniform, None)
    }

    /// Answers all rays, with `then` after each turn, until there are none; false if `progress` cancels. `uniform` is that of a turn.
    pub(crate) fn follow<U: bytemuck::Pod>(
        &self,
        then: &[Entry],
        uniform: impl Fn(u32) -> U,
        progress: &dyn Progress,
    ) -> GpuResult<bool> {
        let mut turns = 2;
        while !progress.cancelled() {
            let counts = self.gpu.upload_slice(&vec![0u32; turns])?;
            for turn in 0..turns {
                for entry in [ENCOUNTER, MARCH, TELL].iter().chain(then) {
                    self.run_with(*entry, bytemuck::bytes_of(&uniform(turn as u32)), Some(&counts))?;
                }
            }
            if self.gpu.read_slice::<u32>(&counts, turns)?.last() == Some(&0) {
                return Ok(true);
            }
            turns = (2 * turns).min(TURNS);
        }
        Ok(false)
    }

    fn run_with(&self, (entry, bound, depends): Entry, uniform: &[u8], counts: Option<&GpuBuffer>) -> GpuResult<()> {
        let own = self.buffers.iter().copied().chain(counts.map(|counts| (COUNTS, counts)));
        let buffers: Vec<(u32, &GpuBuffer)> = own.filter(|(number, _)| bound.contains(number)).collect();
        let constants = self.constants.iter().filter(|(name, _)| depends.is_none_or(|names| names.contains(name)));
        let constants: Vec<(&'static str, f64)> = constants.copied().collect();
        let kernel = Kernel { shader: self.shader, entry, constants: &constants };
        self.gpu.dispatch(&kernel, uniform, &buffers, self.rows.groups())
    }
}
