//! Sparse tracing.

use crate::{Test, support::*};
use glam::Vec3;
use pano_core::gpu::Gpu;
use pano_core::image::Image;
use pano_tests::random::Random;
use pano_trace::sparse::{self, Params, gpu};
use proptest::prelude::*;

pub(crate) const TESTS: &[Test] = &[
    ("sparse::levels_equal_the_cpu", levels_equal_the_cpu),
    ("sparse::interpolation_equals_the_cpu", interpolation_equals_the_cpu),
];

fn levels_equal_the_cpu(device: &Gpu) {
    property(40, (sizes(), any::<u32>()), |(size, seed)| {
        let (layers, mut random) = (layers(size, seed), Random::new(seed));
        // Steps of a centimetre to a decimetre, some places that are none.
        let position = Image::from_fn(size.0, size.1, |x, y| match random.below(60) {
            0 => Vec3::NAN,
            1 => Vec3::INFINITY,
            n => Vec3::new(0.003 * x as f32, 0.004 * y as f32, if n < 4 { 0.05 } else { 0.0 }),
        });
        let active = Image::from_fn(size.0, size.1, |_, _| random.below(30).saturating_sub(28));
        let got = gpu::levels(device, &Params::default(), &position, &layers.normal, &active).unwrap();
        let want = sparse::levels(&Params::default(), &position, &layers.normal, &active);
        // A weight that is a threshold to 1e-5 may fall on either side of it: the level with both thresholds moved.
        let moved = |by: f32| {
            let params = Params { delta1: 0.3 + by, delta2: 0.5 + by, ..Params::default() };
            sparse::levels(&params, &position, &layers.normal, &active)
        };
        let (lower, upper) = (moved(-1e-5), moved(1e-5));
        for i in 0..got.data().len() {
            let (got, want) = (got.data()[i], want.data()[i]);
            prop_assert!(got == want || got == lower.data()[i] || got == upper.data()[i], "{i}: {got} {want}");
        }
        Ok(())
    });
}

fn interpolation_equals_the_cpu(device: &Gpu) {
    property(40, (sizes(), any::<u32>()), |((w, h), seed)| {
        let mut random = Random::new(seed);
        // Levels in patches, as they are: one for each eight by eight pixels.
        let patches: Vec<u8> = (0..64).map(|_| random.below(3) as u8).collect();
        let levels = Image::from_fn(w, h, |x, y| patches[(x / 8 + 5 * (y / 8)) % 64]);
        let mask = Image::from_fn(w, h, |_, _| u32::from(random.below(9) > 0));
        let share = Image::from_fn(w, h, |_, _| [0.0, 1.0, random.unit()][random.below(3) as usize]);
        let signals = [0, 1].map(|_| Image::from_fn(w, h, |_, _| random.color(0.0, 5.0)));
        let (mut got_share, mut got) = (share.clone(), signals.clone());
        gpu::interpolate(device, &levels, &mask, &mut got_share, &mut got.each_mut().into_iter().collect::<Vec<_>>()).unwrap();
        let (mut want_share, mut want) = (share, signals);
        let wanted = |x: usize, y: usize| mask.get(x, y) > 0;
        sparse::interpolate(&levels, wanted, &mut want_share, &mut want.each_mut().into_iter().collect::<Vec<_>>());
        // Four products and a quotient by a share that may be small.
        for (got, want) in got.iter().zip(&want) {
            assert_close("signal", got, want, 1e-6, 2e-6)?;
        }
        prop_assert!(got_share == want_share);
        Ok(())
    });
}
