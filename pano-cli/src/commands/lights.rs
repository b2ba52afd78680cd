//! `pano lights`: the lights of a panorama, or of each frame of a video.

use crate::{failure::Failure, output};
use clap::ValueEnum;
use pano_compose::annotate::{LightMark, draw_lights};
use pano_core::{
    Error,
    io::{self, LoadedImage, SourceEncoding},
    light::DirectionalLight,
    scene::{FramePattern, PicturePath},
};
use pano_light::{
    WorkingMap, clipped,
    detect::{self, Detection},
    track::{self, TrackedLight, Tracker},
};
use serde::Serialize;
use std::{
    fmt::Write,
    path::{Path, PathBuf},
};

/// Arguments of `pano lights`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Directions are unit vectors in the panorama's frame: its centre looks to -Z, +Y is up. Irradiance is \
what exceeds the threshold, on a surface that faces the light, in units of the (inversely tone-mapped) panorama; intensity \
is the irradiance to render with, where clipping is known to have taken light away. PNG and JPEG are inversely tone-mapped \
first. Lights of a sequence are followed from frame to frame and smoothed; `id` tells which is which.")]
pub(crate) struct Args {
    /// Equirectangular panorama, or numbered frames of a video such as frame_%04d.png
    #[arg(value_name = "PANO")]
    panorama: PathBuf,
    /// Picture to write: the panorama with its lights marked; numbered like the frames
    #[arg(short, long, value_name = "PIC")]
    output: Option<PathBuf>,
    /// How lights are found; clipped takes hints on how bright a white patch was, for PNG and JPEG only
    #[arg(long, value_enum, default_value = "mr360")]
    detector: Detector,
    /// Print one JSON object, a line a frame
    #[arg(long)]
    json: bool,
}

/// `--detector`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Detector {
    Mr360,
    Clipped,
}

/// What `--json` prints of one picture.
#[derive(Debug, Serialize)]
struct Listing {
    #[serde(skip_serializing_if = "Option::is_none")]
    frame: Option<u32>,
    threshold: f64,
    mean: f64,
    sigma: f64,
    lights: Vec<Light>,
}

/// One light.
#[derive(Debug, Serialize)]
struct Light {
    /// Of a sequence only.
    #[serde(skip_serializing_if = "Option::is_none")]
    id: Option<u64>,
    direction: [f32; 3],
    irradiance: [f32; 3],
    solid_angle: f32,
    intensity: [f32; 3],
}

/// Runs the command.
pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    if let Some(output) = &args.output {
        check_extension(output)?;
    }
    match FramePattern::new(&args.panorama) {
        Some(pattern) => sequence(args, &pattern),
        None => {
            let picture = load(&args.panorama)?;
            let (_, detection) = detected(args, &args.panorama, &picture)?;
            let listing = Listing::new(&detection, None, detection.lights.iter().map(|l| Light::new(l, None)).collect());
            if let Some(path) = &args.output {
                write_marked(path, picture, &detection.lights)?;
            }
            if args.json { output::print_json(&listing) } else { output::print(&listing.to_text()) }
        }
    }
}

/// A line a frame, in the order of the frames.
fn sequence(args: &Args, pattern: &FramePattern) -> Result<(), Failure> {
    let frames = pattern.existing();
    if frames.is_empty() {
        let problem = format!("no frame of the sequence is there, such as {}", pattern.path(0).display());
        return Err(Error::file(&args.panorama, problem, "check the folder and the number of digits").into());
    }
    let target = args.output.as_deref().map(numbered).transpose()?;
    let mut tracker = Tracker::new(track::Params::default());
    for frame in frames {
        let path = pattern.path(frame);
        let picture = load(&path)?;
        let (map, detection) = detected(args, &path, &picture)?;
        let tracked: Vec<TrackedLight> = tracker.update(&map, &detection.lights);
        let listing = Listing::new(&detection, Some(frame), tracked.iter().map(|t| Light::new(&t.light, Some(t.id))).collect());
        if let Some(target) = &target {
            write_marked(&target.path(frame), picture, &tracked.iter().map(|t| t.light).collect::<Vec<_>>())?;
        }
        if args.json { output::print_json_line(&listing)? } else { output::print(&listing.to_text())? }
    }
    Ok(())
}

fn load(path: &Path) -> Result<LoadedImage, Failure> {
    let picture = io::read_image(path)?;
    let (w, h) = picture.radiance.size();
    if w != 2 * h {
        let problem = format!("the picture is {w}×{h}, which is not 2:1");
        return Err(Error::file(path, problem, "give an equirectangular panorama, twice as wide as high").into());
    }
    Ok(picture)
}

fn detected(args: &Args, path: &Path, picture: &LoadedImage) -> Result<(WorkingMap, Detection), Failure> {
    let hdr = picture.encoding == SourceEncoding::LinearFloat;
    let map = if hdr { WorkingMap::from_hdr(&picture.radiance) } else { WorkingMap::from_ldr(&picture.radiance) };
    let detection = match args.detector {
        Detector::Mr360 => detect::detect(&map, &detect::Params::default()),
        Detector::Clipped if hdr => {
            let problem = "holds linear values, in which nothing is clipped";
            return Err(Error::file(path, problem, "use --detector mr360, or give a PNG or JPEG picture").into());
        }
        Detector::Clipped => clipped::detect(&picture.radiance, &map, &clipped::Params::default()),
    };
    Ok((map, detection))
}

/// What cannot be written is said before the work.
fn check_extension(path: &Path) -> Result<(), Error> {
    let extension = path.extension().and_then(|e| e.to_str()).unwrap_or_default().to_ascii_lowercase();
    if io::IMAGE_EXTENSIONS.contains(&extension.as_str()) {
        return Ok(());
    }
    let problem = "its extension means no picture format that can be written";
    Err(Error::file(path, problem, format!("end it in one of: .{}", io::IMAGE_EXTENSIONS.join(", ."))))
}

/// A picture a frame needs a number in its name.
fn numbered(path: &Path) -> Result<PicturePath, Error> {
    let wrong = || {
        Error::file(path, "a picture a frame does not go into one file", "put a frame number into the name, e.g. lights_%04d.png")
    };
    FramePattern::new(path).map(PicturePath::Frames).ok_or_else(wrong)
}

fn write_marked(path: &Path, picture: LoadedImage, lights: &[DirectionalLight]) -> Result<(), Failure> {
    let mut marked = picture.radiance;
    let marks: Vec<LightMark> = lights.iter().enumerate().map(|(i, l)| LightMark::ranked(i + 1, *l)).collect();
    draw_lights(&mut marked, &marks);
    Ok(io::write_image(path, &marked, picture.alpha.as_ref())?)
}

impl Listing {
    fn new(detection: &Detection, frame: Option<u32>, lights: Vec<Light>) -> Self {
        let Detection { threshold, mean, sigma, .. } = *detection;
        Self { frame, threshold, mean, sigma, lights }
    }

    fn to_text(&self) -> String {
        let mut text = self.frame.map_or(String::new(), |frame| format!("frame {frame}: "));
        // Writing to a string does not fail.
        let _ = writeln!(text, "{} lights above luminance {:.4}", self.lights.len(), self.threshold);
        for (rank, l) in self.lights.iter().enumerate() {
            let [x, y, z] = l.direction;
            let [r, g, b] = l.irradiance;
            let id = l.id.map_or(String::new(), |id| format!("  light {id}"));
            let (yaw, height) = (x.atan2(-z).to_degrees(), y.clamp(-1.0, 1.0).asin().to_degrees());
            let _ = writeln!(
                text,
                "{:>3}  yaw {yaw:7.2}  height {height:6.2}  irradiance {r:.4} {g:.4} {b:.4}  {:.5} sr{id}",
                rank + 1,
                l.solid_angle
            );
        }
        text
    }
}

impl Light {
    fn new(light: &DirectionalLight, id: Option<u64>) -> Self {
        Self {
            id,
            direction: light.direction.to_array(),
            irradiance: light.irradiance.to_array(),
            solid_angle: light.solid_angle,
            intensity: light.intensity.to_array(),
        }
    }
}
