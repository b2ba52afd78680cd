//! Temporal accumulation.

use crate::{Test, support::*};
use glam::{Vec2, Vec3};
use pano_core::gpu::Gpu;
use pano_core::image::Image;
use pano_core::layers::TracedLayers;
use pano_denoise::temporal::{self, Guides, History, Params, gpu::accumulate_picture};
use pano_tests::random::Random;
use proptest::prelude::*;

pub(crate) const TESTS: &[Test] = &[
    ("temporal::equals_the_cpu_over_frames", equals_the_cpu_over_frames),
    ("temporal::huge_values_stay_finite", huge_values_stay_finite),
    ("temporal::another_size_begins_anew", another_size_begins_anew),
];

/// Blends of values up to 30: the deviation of the neighbourhood, a difference of squares, is good to 1e-3 of the values' range.
const ABSOLUTE: f32 = 3e-3;
const RELATIVE: f32 = 1e-4;

/// A frame with its motion: two pixels to the right and half a one down, with places that were not in sight and such that stay.
struct Shown {
    layers: TracedLayers,
    thing: Image<u32>,
    previous: Image<Vec2>,
    previous_depth: Image<f32>,
    sharp: Image<bool>,
    level: Image<u8>,
}

impl Shown {
    fn new(size: (usize, usize), seed: u32) -> Self {
        let mut random = Random::new(seed ^ 0x71);
        let layers = layers(size, seed);
        let (w, h) = size;
        let odd = [Vec2::NAN, Vec2::splat(f32::INFINITY), Vec2::new(-1e7, 3.0), Vec2::new(-0.4, -0.4)];
        let previous = Image::from_fn(w, h, |x, y| match random.below(8) {
            0 => odd[random.below(4) as usize],
            1 | 2 => Vec2::new(x as f32 + 0.5, y as f32 + 0.5),
            _ => Vec2::new(x as f32 - 1.5, y as f32),
        });
        let previous_depth = layers.depth.map(|d| d * 1.01);
        let thing = layers.coverage.map(|c| u32::from(c > 0.5));
        let sharp = Image::from_fn(w, h, |_, _| random.below(4) == 0);
        let level = Image::from_fn(w, h, |_, _| [0, 0, 1, 2][random.below(4) as usize]);
        Self { layers, thing, previous, previous_depth, sharp, level }
    }

    fn guides(&self) -> Guides<'_> {
        Guides {
            depth: &self.layers.depth,
            normal: &self.layers.normal,
            thing: &self.thing,
            previous: &self.previous,
            previous_depth: &self.previous_depth,
            sharp: Some(&self.sharp),
            level: Some(&self.level),
        }
    }
}

fn equals_the_cpu_over_frames(gpu: &Gpu) {
    let clamps = prop_oneof![Just(2.0f32), Just(0.0), Just(f32::INFINITY)];
    property(40, (sizes(), any::<u32>(), any::<bool>(), any::<bool>(), clamps), |(size, seed, wrap, measured, clamp)| {
        let params = Params { wrap, clamp, ..Params::default() };
        let (mut on_gpu, mut on_cpu): (Option<History>, Option<History>) = (None, None);
        for frame in 0..4 {
            let shown = Shown::new(size, seed);
            // The same things in other noise, some of it no number.
            let signal = if frame % 2 == 0 { layers(size, seed ^ frame).object } else { wild(size, 3.0, seed ^ frame) };
            let (mut got, mut want) = (signal.clone(), signal);
            let measured = measured.then(|| want.map(|v| v.x * v.x));
            let a = accumulate_picture(gpu, &params, &shown.guides(), measured.as_ref(), &mut got, &mut on_gpu).unwrap();
            let b = temporal::accumulate(&params, &shown.guides(), measured.as_ref(), &mut want, &mut on_cpu).unwrap();
            assert_close("signal", &got, &want, ABSOLUTE, RELATIVE)?;
            let picture = |variance: &Image<f32>| variance.map(Vec3::splat);
            assert_close("variance", &picture(&a), &picture(&b), ABSOLUTE, 1e-3)?;
            let (a, b) = (on_gpu.as_ref().unwrap(), on_cpu.as_ref().unwrap());
            assert_close("frames", &picture(a.frames()), &picture(b.frames()), ABSOLUTE, 1e-3)?;
            prop_assert!(same_bits(a.signal(), &got));
        }
        Ok(())
    });
}

fn huge_values_stay_finite(gpu: &Gpu) {
    let shown = Shown::new((21, 17), 3);
    let mut history = None;
    for sign in [1.0, -1.0, 1.0] {
        let mut signal = shown.layers.object.map(|v| v * sign * 1e37);
        accumulate_picture(gpu, &Params::default(), &shown.guides(), None, &mut signal, &mut history).unwrap();
        assert!(signal.data().iter().all(|v: &Vec3| v.is_finite()));
    }
}

fn another_size_begins_anew(gpu: &Gpu) {
    let mut history = None;
    for size in [(9, 5), (5, 9)] {
        let shown = Shown::new(size, 1);
        let mut signal = shown.layers.object.clone();
        accumulate_picture(gpu, &Params::default(), &shown.guides(), None, &mut signal, &mut history).unwrap();
        assert!(same_bits(&signal, &shown.layers.object));
        let frames = history.as_ref().unwrap().frames();
        assert!(frames.data().iter().zip(shown.level.data()).all(|(n, level)| *n == 0.25f32.powi(i32::from(*level))));
    }
}
