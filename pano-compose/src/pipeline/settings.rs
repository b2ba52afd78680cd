//! `--set key=value`: the knobs that are neither in the scene file nor among the common options.

use super::{Detector, Error, GPU_STAGES, GpuSettings, Result};
use pano_denoise::cross_bilateral;
use pano_trace::tracer::Mis;
use pano_trace::world::CapturedOptions;

/// One knob.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Setting {
    /// As written on the command line.
    pub key: &'static str,
    /// What it does, its range and its default.
    pub help: &'static str,
}

/// Every knob there is.
pub const SETTINGS: &[Setting] = &[
    Setting { key: "mis", help: "balance | light | bsdf: which strategies sample direct light (balance)" },
    Setting { key: "second_order", help: "true | false: changed surfaces change one another and show in objects (true)" },
    Setting { key: "delta_passes", help: "1–16: how often the change of real surfaces is filtered (3)" },
    Setting {
        key: "sparse",
        help: "true | false: iprt traces one pixel in 4 or 16 where nothing changes, from the second frame on (true)",
    },
    Setting { key: "detector", help: "mr360 | clipped: how mr360 finds the lights of an LDR picture (mr360)" },
    Setting { key: "gloss", help: "0–1: how much real surfaces mirror the objects with mr360; 1 is a polished floor (0)" },
    Setting { key: "gloss_roughness", help: "0–1: how blurred that mirror image is (0.3)" },
    Setting { key: "reflectance_cap", help: "0–1: largest diffuse reflectance read off the picture (0.9)" },
    Setting { key: "field_resolution", help: "quads along a cube face of the depth field; 0: the panorama's own (0)" },
    Setting { key: "gap_contrast", help: "> 1: a depth step this much larger than those beside it is a gap (3)" },
    Setting { key: "gap_relative", help: "> 0: …and larger than this share of the depth (0.01)" },
    Setting { key: "back_faces", help: "true | false: things have back faces at depth gaps (true)" },
    Setting { key: "irradiance_width", help: "8–4096: columns of the irradiance map near objects (512)" },
    Setting { key: "irradiance_samples", help: "1–65536: pairs of rays per texel of it (8)" },
    Setting {
        key: "gpu_from",
        help: "a stage, as --stats names it: the stages before it run on the CPU, whatever the backend (none)",
    },
    Setting { key: "gpu_until", help: "a stage: the stages after it run on the CPU, whatever the backend (none)" },
    Setting { key: "gpu_binding", help: "1–128: MiB that a picture may have on the GPU; larger ones go in bands (128)" },
    Setting { key: "gpu_lose_after", help: "0–1000000: submissions after which the GPU is lost, to try what happens (never)" },
];

/// The knobs' values.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// `mis`.
    pub mis: Mis,
    /// `second_order`.
    pub second_order: bool,
    /// `delta_passes`.
    pub delta_passes: u32,
    /// `sparse`.
    pub sparse: bool,
    /// `detector`.
    pub detector: Detector,
    /// `gloss`.
    pub gloss: f32,
    /// `gloss_roughness`.
    pub gloss_roughness: f32,
    /// How a captured field is prepared.
    pub captured: CapturedOptions,
    /// `gpu_from`, `gpu_until`, `gpu_binding`, `gpu_lose_after`.
    pub gpu: GpuSettings,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            mis: Mis::Balance,
            second_order: true,
            sparse: true,
            delta_passes: cross_bilateral::Params::default().delta_passes,
            detector: Detector::default(),
            gloss: 0.0,
            gloss_roughness: 0.3,
            captured: CapturedOptions::default(),
            gpu: GpuSettings::default(),
        }
    }
}

impl Settings {
    /// Sets one knob.
    ///
    /// # Errors
    /// [`Error::Unsupported`] for an unknown key (the remedy lists the known ones) or a value out of range.
    pub fn set(&mut self, key: &str, value: &str) -> Result<()> {
        let Some(setting) = SETTINGS.iter().find(|s| s.key == key) else {
            let known: Vec<&str> = SETTINGS.iter().map(|s| s.key).collect();
            return Err(Error::unsupported(format!("there is no setting `{key}`"), format!("use one of {}", known.join(", "))));
        };
        let bad = || Error::unsupported(format!("`{value}` is no value of `{key}`"), setting.help);
        let number = |lo: f32, hi: f32| value.parse::<f32>().ok().filter(|v| (lo..=hi).contains(v)).ok_or_else(bad);
        let count = |lo: u32, hi: u32| value.parse::<u32>().ok().filter(|v| (lo..=hi).contains(v)).ok_or_else(bad);
        let stage = || GPU_STAGES.iter().position(|s| *s == value).ok_or_else(bad);
        match key {
            "mis" => {
                self.mis = match value {
                    "balance" => Mis::Balance,
                    "light" => Mis::LightOnly,
                    "bsdf" => Mis::BsdfOnly,
                    _ => return Err(bad()),
                }
            }
            "second_order" => self.second_order = value.parse().map_err(|_| bad())?,
            "delta_passes" => self.delta_passes = count(1, 16)?,
            "sparse" => self.sparse = value.parse().map_err(|_| bad())?,
            "detector" => {
                self.detector = match value {
                    "mr360" => Detector::Mr360,
                    "clipped" => Detector::Clipped,
                    _ => return Err(bad()),
                }
            }
            "gloss" => self.gloss = number(0.0, 1.0)?,
            "gloss_roughness" => self.gloss_roughness = number(0.0, 1.0)?,
            "reflectance_cap" => self.captured.reflectance_cap = number(0.0, 1.0)?,
            "field_resolution" => self.captured.field.resolution = count(0, 4096)? as usize,
            "gap_contrast" => self.captured.field.gap_contrast = number(1.0, 1e6)?,
            "gap_relative" => self.captured.field.gap_relative = number(1e-6, 1.0)?,
            "back_faces" => self.captured.field.back_faces = value.parse().map_err(|_| bad())?,
            "irradiance_width" => self.captured.irradiance_width = count(8, 4096)? as usize,
            "irradiance_samples" => self.captured.irradiance_samples = count(1, 65536)?,
            "gpu_from" => self.gpu.from = Some(stage()?),
            "gpu_until" => self.gpu.until = Some(stage()?),
            "gpu_binding" => self.gpu.max_binding = Some(u64::from(count(1, 128)?) << 20),
            "gpu_lose_after" => self.gpu.lose_after = Some(count(0, 1_000_000)?),
            _ => unreachable!("every key of SETTINGS is matched: {key}"),
        }
        Ok(())
    }
}
