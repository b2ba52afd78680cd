//! `pano lights`: the lights of a panorama.

use crate::{failure::Failure, output};
use pano_core::{
    Error,
    image::RadianceImage,
    io::{self, SourceEncoding},
    light::DirectionalLight,
};
use pano_light::{
    WorkingMap,
    detect::{self, Detection},
};
use serde::Serialize;
use std::path::{Path, PathBuf};

/// Arguments of `pano lights`.
#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    /// Equirectangular panorama
    panorama: PathBuf,
    /// Print one JSON object
    #[arg(long)]
    json: bool,
}

/// What `--json` prints.
#[derive(Debug, Serialize)]
struct Listing {
    threshold: f64,
    mean: f64,
    sigma: f64,
    found: usize,
    lights: Vec<Light>,
}

#[derive(Debug, Serialize)]
struct Light {
    direction: [f32; 3],
    irradiance: [f32; 3],
    solid_angle: f32,
    intensity: [f32; 3],
}

impl From<&Detection> for Listing {
    fn from(d: &Detection) -> Self {
        let light = |l: &DirectionalLight| Light {
            direction: l.direction.to_array(),
            irradiance: l.irradiance.to_array(),
            solid_angle: l.solid_angle,
            intensity: l.intensity.to_array(),
        };
        Self {
            threshold: d.threshold,
            mean: d.mean,
            sigma: d.sigma,
            found: d.found,
            lights: d.lights.iter().map(light).collect(),
        }
    }
}

/// Runs the command.
pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    let picture = io::read_image(&args.panorama)?;
    let map = if picture.encoding == SourceEncoding::LinearFloat {
        WorkingMap::from_hdr(&picture.radiance)
    } else {
        WorkingMap::from_ldr(&picture.radiance)
    };
    let d = if std::env::var("CL").is_ok() {
        pano_light::clipped::detect(&picture.radiance, &map, &Default::default())
    } else {
        detect::detect(&map, &detect::Params::default())
    };
    output::print_json(&Listing::from(&d))
}
