//! Writes the pictures of docs/rt2ar.md: for each case the path-traced truth, rt2ar from a panorama with depth, and rt2ar
//! through a depth camera, from left to right.
//!
//! `cargo run --release -p pano-compose --features demo --example rt2ar_cases -- FOLDER [CASE]`

use glam::Vec3;
use pano_compose::demo::{CaseParams, cases};
use pano_core::image::RadianceImage;
use pano_core::{io, metrics, progress::Silent};
use std::path::PathBuf;

/// Pixels between pictures.
const GAP: usize = 6;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let folder = PathBuf::from(std::env::args().nth(1).ok_or("name a folder to write to")?);
    std::fs::create_dir_all(&folder)?;
    let params = CaseParams { panorama_width: 1024, captured_samples: 12, size: (320, 240), samples: 16, truth_samples: 32 };
    for case in cases(&params, std::env::args().nth(2).as_deref(), &Silent)? {
        // Ordinary light is white at the brightness that few pixels exceed.
        let mut brightest: Vec<f32> = case.truth.data().iter().map(|p| p.max_element()).collect();
        brightest.sort_unstable_by(f32::total_cmp);
        let white = brightest[brightest.len() * 985 / 1000];
        let pictures = [&case.truth, &case.panorama.composite.color, &case.camera.composite.color].map(|p| p.map(|v| v / white));
        let encoded = pictures.each_ref().map(|p| p.map(|v| v.map(pano_core::color::linear_to_srgb)));
        for (name, rendered, picture) in [("panorama", &case.panorama, &encoded[1]), ("camera", &case.camera, &encoded[2])] {
            let trace = rendered.stats.stages.iter().find(|s| s.name == "trace").map_or(0.0, |s| s.ms);
            let (psnr, flip) = (metrics::psnr(picture, &encoded[0], None)?, metrics::flip(picture, &encoded[0], None)?);
            println!("{:<13} {name:<9} {trace:>7.0} ms  PSNR {psnr:.1} dB  FLIP {flip:.3}", case.name);
        }
        let (w, h) = params.size;
        let strip = RadianceImage::from_fn(3 * w + 2 * GAP, h, |x, y| {
            let (i, at) = (x / (w + GAP), x % (w + GAP));
            if at < w { pictures[i].get(at, y) } else { Vec3::ONE }
        });
        io::write_image(folder.join(format!("rt2ar-{}.jpg", case.name.replace(' ', "-"))), &strip, None)?;
    }
    Ok(())
}
