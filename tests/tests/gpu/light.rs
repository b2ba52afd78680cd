//! Light of a panorama: the working map, detection, maps for image-based lighting.

use crate::{Test, support::*};
use glam::Vec3;
use pano_core::gpu::{Gpu, GpuOptions};
use pano_core::image::{Image, RadianceImage};
use pano_light::{WorkingMap, detect, ibl};
use pano_tests::random::Random;
use pano_tests::rooms::texel_direction;
use proptest::prelude::*;

pub(crate) const TESTS: &[Test] = &[
    ("light::working_maps_equal_the_cpu", working_maps_equal_the_cpu),
    ("light::detection_equals_the_cpu", detection_equals_the_cpu),
    ("light::radiance_maps_equal_the_cpu", radiance_maps_equal_the_cpu),
    ("light::bands_make_no_difference", bands_make_no_difference),
];

/// A sky with lamps, one over the seam and one near the zenith, and noise.
fn sky((width, height): (usize, usize), seed: u32) -> RadianceImage {
    let mut random = Random::new(seed);
    let lamps: Vec<(Vec3, f32)> = [Vec3::new(0.0, 0.6, 1.0), Vec3::new(0.1, 1.0, 0.1), random.direction()]
        .map(|d| (d.normalize(), random.between(0.95, 0.999)))
        .to_vec();
    Image::from_fn(width, height, |x, y| {
        let d = texel_direction(width, height, x, y);
        let lit = lamps.iter().any(|(lamp, cos)| d.dot(*lamp) > *cos);
        random.color(0.1, 0.3) + if lit { Vec3::splat(40.0) } else { Vec3::ZERO }
    })
}

fn working_maps_equal_the_cpu(gpu: &Gpu) {
    for size in [(1, 1), (37, 11), (64, 32), (601, 299), (1400, 400), (1280, 640)] {
        for odd in [false, true] {
            let panorama = if odd { wild(size, 1.2, 7) } else { sky(size, 7) };
            for from_ldr in [false, true] {
                let got = WorkingMap::on_gpu(gpu, &panorama, from_ldr).unwrap();
                let want = if from_ldr { WorkingMap::from_ldr(&panorama) } else { WorkingMap::from_hdr(&panorama) };
                assert_eq!(got.is_from_ldr(), from_ldr);
                // The CPU lets infinity be 10³⁰; what is at the GPU's own limit is out of this comparison.
                let (got, want) = (got.radiance(), want.radiance().map(|v| if v.max_element() > 1e10 { Vec3::NAN } else { v }));
                let got = Image::from_fn(600, 300, |x, y| if want.get(x, y).is_nan() { Vec3::NAN } else { got.get(x, y) });
                assert_close(&format!("{size:?} LDR {from_ldr}"), &got, &want, 1e-6, 2e-5).unwrap();
            }
        }
    }
}

fn detection_equals_the_cpu(gpu: &Gpu) {
    property(8, (any::<u32>(), 0usize..5), |(seed, blur_radius)| {
        let map = WorkingMap::from_hdr(&sky((300, 150), seed));
        let params = detect::Params { blur_radius, ..detect::Params::default() };
        let (got, want) = (detect::gpu::detect(gpu, &map, &params).unwrap(), detect::detect(&map, &params));
        // Sums of up to 81 luminances in f32.
        prop_assert!((got.threshold - want.threshold).abs() <= 1e-5 * want.threshold, "{} {}", got.threshold, want.threshold);
        prop_assert!((got.mean - want.mean).abs() <= 1e-5 * want.mean && (got.sigma - want.sigma).abs() <= 1e-5 * want.sigma);
        prop_assert_eq!(got.lights.len(), want.lights.len());
        for (a, b) in got.lights.iter().zip(&want.lights) {
            // A pixel at the threshold may fall on either side; it has next to nothing of the light.
            prop_assert!(a.direction.distance(b.direction) < 1e-3, "{a:?} {b:?}");
            prop_assert!((a.irradiance - b.irradiance).abs().max_element() <= 1e-3 * b.irradiance.max_element(), "{a:?} {b:?}");
        }
        Ok(())
    });
}

fn radiance_maps_equal_the_cpu(gpu: &Gpu) {
    for (size, seed) in [((600, 300), 1), ((256, 128), 2), ((64, 32), 3), ((3, 2), 4), ((1, 1), 5)] {
        let panorama = sky(size, seed);
        let (got, want) = (ibl::gpu::radiance_maps(gpu, &panorama).unwrap(), ibl::radiance_maps(&panorama));
        // 36 lookups in levels that are means of means, against a running sum on the CPU.
        assert_close("diffuse", &got.diffuse, &want.diffuse, 1e-4, 1e-4).unwrap();
        for (a, b) in got.glossy.iter().zip(&want.glossy) {
            assert_close("glossy", a, b, 1e-3, 1e-4).unwrap();
        }
        assert!(got.mirror == want.mirror);
    }
}

fn bands_make_no_difference(gpu: &Gpu) {
    // A megabyte: the panorama goes in four bands; the maps themselves fit.
    let small = Gpu::new(&GpuOptions { max_binding: Some(3 << 20), ..GpuOptions::default() }).unwrap();
    let panorama = sky((1280, 640), 3);
    for from_ldr in [false, true] {
        let [a, b] = [&small, gpu].map(|g| WorkingMap::on_gpu(g, &panorama, from_ldr).unwrap());
        assert_close("map", a.radiance(), b.radiance(), 0.0, 2e-5).unwrap();
    }
}
