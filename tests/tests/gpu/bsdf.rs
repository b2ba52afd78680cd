//! Scattering at surfaces.

use crate::Test;
use bytemuck::{Pod, Zeroable};
use glam::{Vec3, Vec4};
use pano_core::gpu::{Gpu, Kernel};
use pano_core::random::{Sampler, Stream};
use pano_tests::random::Random;
use pano_tests::shaders::BSDF_PROBE;
use pano_trace::bsdf::{Bsdf, BsdfParams, CoatTable, SMOOTH_ALPHA};

pub(crate) const TESTS: &[Test] = &[
    ("bsdf::every_surface_scatters_as_on_the_cpu", every_surface_scatters_as_on_the_cpu),
    ("bsdf::what_is_left_out_is_not_missed", what_is_left_out_is_not_missed),
];

/// `Question` of the shader.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
struct Question {
    base_color: Vec3,
    metallic: f32,
    specular_color: Vec3,
    specular: f32,
    alpha: f32,
    ior: f32,
    transmission: f32,
    flags: u32,
    geometric: Vec3,
    pad1: u32,
    normal: Vec3,
    pad2: u32,
    out: Vec3,
    pad3: u32,
    direction: Vec3,
    pad4: u32,
    u: Vec4,
}

/// `Reply` of the shader.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
struct Reply {
    f_cos: Vec3,
    pdf: f32,
    direction: Vec3,
    sample_pdf: f32,
    weight: Vec3,
    flags: u32,
    lobes: Lobes,
}

/// `Lobes` of the shader.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
struct Lobes {
    diffuse: Vec3,
    roughness: f32,
    specular: Vec3,
    transmission: f32,
}

const IOR: f32 = 1.45;

/// A surface of any kind, pure ones and mixtures, seen from any side, and a direction: any, or the mirrored one, about which narrow
/// lobes are.
fn question(random: &mut Random, index: u32, plain: bool) -> Question {
    let share = |random: &mut Random| match random.below(3) {
        0 => 0.0,
        1 => 1.0,
        _ => random.unit(),
    };
    let alpha = match random.below(4) {
        0 => 0.0,
        1 => random.between(0.0, 0.1),
        _ => random.unit(),
    };
    let normal = random.direction();
    let geometric = if random.below(2) == 0 { normal } else { (normal + 0.3 * random.direction()).normalize() };
    let out = random.direction();
    let direction = match random.below(3) {
        0 => (normal * (2.0 * out.dot(normal)) - out).normalize(),
        _ => random.direction(),
    };
    Question {
        base_color: random.color(0.0, 1.0),
        metallic: if plain { 0.0 } else { share(random) },
        specular_color: random.color(0.0, 1.0),
        specular: if plain { 0.0 } else { share(random) },
        alpha,
        ior: IOR,
        transmission: if plain { 0.0 } else { share(random) },
        flags: random.below(4),
        geometric,
        normal,
        out,
        direction,
        u: Vec4::from_array(Sampler::new(glam::UVec2::new(index, 7), 0, Stream::default()).next_4d()),
        ..Zeroable::zeroed()
    }
}

impl Question {
    fn bsdf<'a>(&self, coat: &'a CoatTable) -> Bsdf<'a> {
        let params = BsdfParams {
            base_color: self.base_color,
            metallic: self.metallic,
            alpha: self.alpha,
            specular: self.specular,
            specular_color: self.specular_color,
            ior: self.ior,
            transmission: self.transmission,
            thin: self.flags & 1 != 0,
            coat: (self.flags & 2 != 0).then_some(coat),
        };
        Bsdf::new(&params, self.geometric, self.normal, self.out)
    }

    /// How far values of both sides may lie apart, relatively. They add and multiply the same numbers, but 1 − z²(1 − α²), of which
    /// GGX takes the square, is known to a few units in the last place of 1 only: relatively that is 2⁻²²/α². The index over the
    /// lobe of a body adds such a cancellation of its own, and grazing directions divide by a cosine.
    ///
    /// `off` is how far `direction` itself is off: near the horizon its cosine is the root of a difference from 1.
    fn tolerance(&self, direction: Vec3, off: f32) -> f32 {
        let alpha2 = (self.alpha * self.alpha).max(SMOOTH_ALPHA * SMOOTH_ALPHA);
        let grazing = self.normal.dot(self.out).abs().min(self.normal.dot(direction).abs()).max(1e-4);
        1e-5 + 4e-6 / alpha2 + (1e-6 + 2.0 * off) / grazing
    }
}

fn ask(gpu: &Gpu, questions: &[Question], coat: &CoatTable, constants: &[(&'static str, f64)]) -> Vec<Reply> {
    let (given, table) = (gpu.upload_slice(questions).unwrap(), gpu.upload_slice(&coat.values().collect::<Vec<f32>>()).unwrap());
    let replies = gpu.buffer::<Reply>(questions.len()).unwrap();
    let kernel = Kernel { shader: &BSDF_PROBE, entry: "scatter", constants };
    let uniform = [questions.len() as u32, 0, 0, 0];
    let groups = [questions.len().div_ceil(64) as u32, 1, 1];
    gpu.dispatch(&kernel, bytemuck::bytes_of(&uniform), &[(1, &given), (2, &replies), (3, &table)], groups).unwrap();
    gpu.read_slice(&replies, questions.len()).unwrap()
}

/// How many questions got another kind of answer: a discrete choice (a lobe, a side) that rounding has turned over.
fn compare(questions: &[Question], replies: &[Reply], coat: &CoatTable) -> usize {
    let mut turned = 0;
    for (i, (q, reply)) in questions.iter().zip(replies).enumerate() {
        let bsdf = q.bsdf(coat);
        let told = || format!("question {i}: {q:?}\n{reply:?}");
        assert_eq!(bsdf.is_specular(), reply.flags & 4 != 0, "{}", told());
        let near = |got: f32, want: f32, tolerance: f32| (got - want).abs() <= tolerance * want.abs().max(got.abs()) + 1e-6;
        let near3 = |got: Vec3, want: Vec3, tolerance: f32| (0..3).all(|c| near(got[c], want[c], tolerance));

        // Tables, a polynomial and a power of two.
        let (got, want) = (reply.lobes, bsdf.lobes());
        let same = near3(got.diffuse, want.diffuse, 1e-5) && near3(got.specular, want.specular, 2e-5);
        let same = same && near(got.transmission, want.transmission, 1e-6) && near(got.roughness, want.roughness, 1e-6);
        assert!(same, "{want:?}, {}", told());

        let value = bsdf.eval(q.direction);
        let tolerance = q.tolerance(q.direction, 0.0);
        if (value.pdf_solid_angle > 0.0) != (reply.pdf > 0.0) {
            turned += 1;
        } else {
            let same = near(reply.pdf, value.pdf_solid_angle, tolerance) && near3(reply.f_cos, value.f_cos, tolerance);
            assert!(same, "{value:?}, tolerance {tolerance}, {}", told());
        }
        let sample = bsdf.sample(q.u.to_array());
        let kind = sample.map_or(0, |s| 1 | u32::from(s.specular) << 1);
        match sample {
            Some(sample) if kind == reply.flags & 3 && sample.direction.distance(reply.direction) < 0.1 => {
                let off = sample.direction.distance(reply.direction);
                let tolerance = q.tolerance(sample.direction, off);
                assert!(off < 1e-4, "{sample:?}, {}", told());
                assert!(near3(reply.weight, sample.weight, tolerance), "{sample:?}, tolerance {tolerance}, {}", told());
                // The density changes over the width of the lobe: by what the direction is off, over α.
                let steep = tolerance + 1e-4 / q.alpha.max(1e-2);
                assert!(sample.specular || near(reply.sample_pdf, sample.pdf_solid_angle, steep), "{sample:?}, {}", told());
            }
            None if reply.flags & 1 == 0 => {}
            _ => turned += 1,
        }
    }
    turned
}

fn every_surface_scatters_as_on_the_cpu(gpu: &Gpu) {
    let coat = CoatTable::new(IOR);
    let mut random = Random::new(41);
    let questions: Vec<Question> = (0..100_000).map(|i| question(&mut random, i, false)).collect();
    let turned = compare(&questions, &ask(gpu, &questions, &coat, &[]), &coat);
    println!("{} questions, {turned} choices turned over", questions.len());
    assert!(turned * 5000 <= questions.len(), "{turned} choices turned over");
}

/// Surfaces that only scatter diffusely are the same without the text for all others.
fn what_is_left_out_is_not_missed(gpu: &Gpu) {
    let coat = CoatTable::new(IOR);
    let mut random = Random::new(42);
    let questions: Vec<Question> = (0..2000).map(|i| question(&mut random, i, true)).collect();
    let replies = ask(gpu, &questions, &coat, &[("GLOSS", 0.0), ("BODIES", 0.0)]);
    assert_eq!(compare(&questions, &replies, &coat), 0);
}
