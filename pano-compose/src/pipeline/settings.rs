//! `--set key=value`: the knobs that are neither in the scene file nor among the common options.

use super::{Detector, Error, GPU_STAGES, GpuSettings, Result};
use crate::lens;
use pano_core::texture::MAX_ANISOTROPY;
use pano_denoise::{cross_bilateral, mean};
use pano_trace::rt2ar::{self, Shadow};
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
    Setting {
        key: "error_target",
        help: "0–1: adaptive sampling of the path tracers: the noise, as a share of the frame's mean luminance, that noisy pixels keep; `samples` is then the most (off)",
    },
    Setting { key: "second_order", help: "true | false: changed surfaces change one another and show in objects (true)" },
    Setting { key: "delta_passes", help: "1–16: how often the change of real surfaces is filtered (3)" },
    Setting {
        key: "sparse",
        help: "true | false: iprt traces one pixel in 4 or 16 where nothing changes, from the second frame on (true)",
    },
    Setting { key: "detector", help: "mr360 | clipped: how mr360 finds the lights of an LDR picture (mr360)" },
    Setting {
        key: "gloss",
        help: "0–1: how much real surfaces mirror the objects with mr360 and rt2ar; 1 is a polished floor (0)",
    },
    Setting { key: "gloss_roughness", help: "0–1: how blurred that mirror image is (0.3)" },
    Setting {
        key: "shadow",
        help: "hard | soft | adaptive: rt2ar's shadows; adaptive looks closer only where probes disagree (adaptive)",
    },
    Setting { key: "shadow_samples", help: "1–256: samples of each light with rt2ar, the steps of its penumbrae (20)" },
    Setting { key: "probes", help: "5–64: of these, the ones that tell rt2ar whether there is a penumbra (5)" },
    Setting {
        key: "probe_neighbours",
        help: "true | false: rt2ar looks closer beside penumbrae and edges, too, which finds what the probes miss (true)",
    },
    Setting { key: "penumbra_radius", help: "0–16: pixels to each side over which rt2ar's penumbrae are averaged (1)" },
    Setting {
        key: "anisotropy",
        help: "0–64: lookups of a texture along what a ray of rt2ar covers; more are sharper at grazing angles, 0 filters none (16)",
    },
    Setting { key: "bloom", help: "0–1: share of the objects' bright light that a lens spreads around it (0: off)" },
    Setting { key: "glare", help: "0–1: share of still brighter light that goes into rays (0: off)" },
    Setting { key: "lens_threshold", help: "≥ 0: luminance from which light is bright (1)" },
    Setting {
        key: "bloom_radius",
        help: "0.001–0.25: standard deviation of the bloom, as a share of the picture's height (0.02)",
    },
    Setting { key: "glare_attenuation", help: "0.5–0.99: what a pixel of the way leaves of a ray (0.9)" },
    Setting { key: "glare_passes", help: "1–4: each makes the rays four times as long (3)" },
    Setting {
        key: "lens_light",
        help: "objects | all: whose bright light is spread; the photo went through a lens already (objects)",
    },
    Setting { key: "reflectance_cap", help: "0–1: largest diffuse reflectance read off the picture (0.9)" },
    Setting { key: "field_resolution", help: "quads along a cube face of the depth field; 0: the panorama's own (0)" },
    Setting { key: "gap_contrast", help: "> 1: a depth step this much larger than those beside it is a gap (3)" },
    Setting { key: "gap_relative", help: "> 0: …and larger than this share of the depth (0.01)" },
    Setting { key: "back_faces", help: "true | false: things have back faces at depth gaps (true)" },
    Setting {
        key: "mirrors",
        help: "true | false: objects see in shining surfaces what those mirror from where they are (true)",
    },
    Setting { key: "irradiance_width", help: "8–4096: columns of the irradiance map near objects (512)" },
    Setting { key: "irradiance_samples", help: "1–65536: pairs of rays per texel of it (8)" },
    Setting {
        key: "hidden_samples",
        help: "0–64 | auto: pairs of rays for the light on sides not seen; 0: the colour of the front (auto: 4 with iprt, else 1)",
    },
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
    /// `error_target`; `None` for `off`.
    pub error_target: Option<f32>,
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
    /// `shadow`.
    pub shadow: Shadow,
    /// `shadow_samples`.
    pub shadow_samples: u32,
    /// `probes`.
    pub probes: u32,
    /// `probe_neighbours`.
    pub probe_neighbours: bool,
    /// `penumbra_radius`.
    pub penumbra_radius: usize,
    /// `anisotropy`.
    pub anisotropy: u32,
    /// `bloom`, `glare`, `lens_threshold`, `bloom_radius`, `glare_attenuation`, `glare_passes` and `lens_light`.
    pub lens: lens::Params,
    /// How a captured field is prepared.
    pub captured: CapturedOptions,
    /// `hidden_samples`, of those options; `None`: as many as suit the method.
    pub hidden_samples: Option<u32>,
    /// `gpu_from`, `gpu_until`, `gpu_binding`, `gpu_lose_after`.
    pub gpu: GpuSettings,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            mis: Mis::Balance,
            error_target: None,
            second_order: true,
            sparse: true,
            delta_passes: cross_bilateral::Params::default().delta_passes,
            detector: Detector::default(),
            gloss: 0.0,
            gloss_roughness: 0.3,
            shadow: Shadow::default(),
            shadow_samples: 20,
            probes: rt2ar::PROBES[0],
            probe_neighbours: true,
            penumbra_radius: mean::Params::default().radius,
            anisotropy: 16,
            lens: lens::Params::default(),
            captured: CapturedOptions::default(),
            hidden_samples: None,
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
            "error_target" if value == "off" => self.error_target = None,
            "error_target" => self.error_target = Some(number(0.0, 1.0)?),
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
            "shadow" => {
                self.shadow = match value {
                    "hard" => Shadow::Hard,
                    "soft" => Shadow::Soft,
                    "adaptive" => Shadow::Adaptive,
                    _ => return Err(bad()),
                }
            }
            "shadow_samples" => self.shadow_samples = count(1, rt2ar::MAX_SHADOW_SAMPLES)?,
            "probes" => self.probes = count(rt2ar::PROBES[0], rt2ar::PROBES[1])?,
            "probe_neighbours" => self.probe_neighbours = value.parse().map_err(|_| bad())?,
            "penumbra_radius" => self.penumbra_radius = count(0, mean::MAX_RADIUS as u32)? as usize,
            "anisotropy" => self.anisotropy = count(0, MAX_ANISOTROPY)?,
            "bloom" => self.lens.bloom = number(0.0, 1.0)?,
            "glare" => self.lens.glare = number(0.0, 1.0)?,
            "lens_threshold" => self.lens.threshold = number(0.0, 1e9)?,
            "bloom_radius" => self.lens.radius = number(0.001, 0.25)?,
            "glare_attenuation" => self.lens.attenuation = number(0.5, 0.99)?,
            "glare_passes" => self.lens.passes = count(1, 4)?,
            "lens_light" => {
                self.lens.everything = match value {
                    "objects" => false,
                    "all" => true,
                    _ => return Err(bad()),
                }
            }
            "reflectance_cap" => self.captured.reflectance_cap = number(0.0, 1.0)?,
            "field_resolution" => self.captured.field.resolution = count(0, 4096)? as usize,
            "gap_contrast" => self.captured.field.gap_contrast = number(1.0, 1e6)?,
            "gap_relative" => self.captured.field.gap_relative = number(1e-6, 1.0)?,
            "back_faces" => self.captured.field.back_faces = value.parse().map_err(|_| bad())?,
            "mirrors" => self.captured.mirrors = value.parse().map_err(|_| bad())?,
            "irradiance_width" => self.captured.irradiance_width = count(8, 4096)? as usize,
            "irradiance_samples" => self.captured.irradiance_samples = count(1, 65536)?,
            "hidden_samples" => self.hidden_samples = if value == "auto" { None } else { Some(count(0, 64)?) },
            "gpu_from" => self.gpu.from = Some(stage()?),
            "gpu_until" => self.gpu.until = Some(stage()?),
            "gpu_binding" => self.gpu.max_binding = Some(u64::from(count(1, 128)?) << 20),
            "gpu_lose_after" => self.gpu.lose_after = Some(count(0, 1_000_000)?),
            _ => unreachable!("every key of SETTINGS is matched: {key}"),
        }
        Ok(())
    }
}
