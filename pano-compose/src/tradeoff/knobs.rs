//! Every knob that trades accuracy for time, in one table.

use crate::pipeline::{Error, RenderOptions, Result, Settings};
use pano_core::scene::{Method, Scene};
use serde::Serialize;

/// Which methods a knob acts on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Scope {
    /// All of them.
    All,
    /// All that work on a panorama with depth.
    Captured,
    /// Delta path tracing.
    Delta,
    /// The path tracers: `dpt`, `onepass`, `twopass`, `ibl`.
    Paths,
    /// Recursive rays.
    Rt2ar,
}

/// One knob.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Knob {
    /// `samples`, `bounces`, `denoise`, or a key of `--set`.
    pub name: &'static str,
    /// What its values count.
    pub unit: &'static str,
    /// What may be asked for.
    pub range: &'static str,
    /// As it is if nothing is asked for.
    pub default: &'static str,
    /// The error that a cheap value causes.
    pub error: &'static str,
    /// What a sweep tries, from cheap to dear; the default is among them.
    #[serde(skip)]
    pub values: &'static [&'static str],
    /// Where it acts.
    pub scope: Scope,
}

/// The table. `samples`, `denoise` and two numbers of bounces are swept in combination, also with cheaper [`PREPARATIONS`]; all
/// but `samples` and `denoise` also by themselves.
pub const KNOBS: &[Knob] = &[
    Knob {
        name: "samples",
        unit: "samples a pixel",
        range: "1 to 65536",
        default: "64",
        error: "noise, which falls with the square root",
        values: &["1", "4", "16", "64", "256", "1024"],
        scope: Scope::All,
    },
    Knob {
        name: "bounces",
        unit: "scattering events",
        range: "1 to 64",
        default: "3",
        error: "dark where light arrives by way of several surfaces: glass, mirrors facing each other",
        values: &["1", "2", "3", "6"],
        scope: Scope::All,
    },
    Knob {
        name: "denoise",
        unit: "switch",
        range: "true, false",
        default: "true",
        error: "noise without, slightly soft shadows and reflections with",
        values: &["false", "true"],
        scope: Scope::All,
    },
    Knob {
        name: "delta_passes",
        unit: "passes of the filter",
        range: "1 to 16",
        default: "3",
        error: "noise in shadows with few, soft shadows with many",
        values: &["1", "2", "3", "5"],
        scope: Scope::All,
    },
    Knob {
        name: "second_order",
        unit: "switch",
        range: "true, false",
        default: "true",
        error: "a shadow is missing in a mirror, and its light on the wall beside it",
        values: &["false", "true"],
        scope: Scope::Captured,
    },
    Knob {
        name: "mis",
        unit: "strategies",
        range: "light, bsdf, balance",
        default: "balance",
        error: "noise: of small lights with `bsdf`, of gloss with `light`",
        values: &["light", "bsdf", "balance"],
        scope: Scope::Delta,
    },
    Knob {
        name: "error_target",
        unit: "noise as a share of the frame's mean luminance, or off",
        range: "0 to 1, off",
        default: "off",
        error: "noise, where there is least of it for the samples spent",
        values: &["0.2", "0.1", "0.05", "0.02", "off"],
        scope: Scope::Paths,
    },
    Knob {
        name: "field_resolution",
        unit: "quads along a cube face, 0: the panorama's own",
        range: "0 to 4096",
        default: "0",
        error: "contact shadows and edges of the real surfaces move",
        values: &["64", "128", "256", "0"],
        scope: Scope::Captured,
    },
    Knob {
        name: "back_faces",
        unit: "switch",
        range: "true, false",
        default: "true",
        error: "what the panorama could not see of things lets light through and is missing in mirrors",
        values: &["false", "true"],
        scope: Scope::Captured,
    },
    Knob {
        name: "mirrors",
        unit: "switch",
        range: "true, false",
        default: "true",
        error: "objects see in shining surfaces what the panorama saw in them",
        values: &["false", "true"],
        scope: Scope::Captured,
    },
    Knob {
        name: "irradiance_width",
        unit: "columns",
        range: "8 to 4096",
        default: "512",
        error: "reflectance of real surfaces smears across existing shadows",
        values: &["128", "256", "512", "1024"],
        scope: Scope::Captured,
    },
    Knob {
        name: "irradiance_samples",
        unit: "pairs of rays a texel",
        range: "1 to 65536",
        default: "8",
        error: "blotches in the depth of shadows",
        values: &["1", "2", "8", "32"],
        scope: Scope::Captured,
    },
    Knob {
        name: "hidden_samples",
        unit: "pairs of rays",
        range: "0 to 64, or auto: 4 with iprt, else 1",
        default: "auto",
        error: "noise in mirrors, or the wrong light, on sides that the panorama has not seen",
        values: &["0", "auto", "16"],
        scope: Scope::Captured,
    },
    Knob {
        name: "anisotropy",
        unit: "lookups of a texture",
        range: "0 to 64; 0: one unfiltered lookup",
        default: "16",
        error: "moiré, or blurred textures at grazing angles",
        values: &["0", "1", "4", "16"],
        scope: Scope::Rt2ar,
    },
    Knob {
        name: "shadow",
        unit: "kind",
        range: "hard, soft, adaptive",
        default: "adaptive",
        error: "shadows without penumbrae with `hard`; thin penumbrae that probes miss with `adaptive`",
        values: &["hard", "adaptive", "soft"],
        scope: Scope::Rt2ar,
    },
    Knob {
        name: "shadow_samples",
        unit: "samples of each light",
        range: "1 to 256",
        default: "20",
        error: "steps and noise in penumbrae",
        values: &["5", "10", "20", "50", "128"],
        scope: Scope::Rt2ar,
    },
    Knob {
        name: "probes",
        unit: "samples of each light that tell whether there is a penumbra",
        range: "5 to 64",
        default: "5",
        error: "penumbrae of things thinner than the light are missed",
        values: &["5", "9", "13", "20"],
        scope: Scope::Rt2ar,
    },
    Knob {
        name: "probe_neighbours",
        unit: "switch",
        range: "true, false",
        default: "true",
        error: "as with few probes",
        values: &["false", "true"],
        scope: Scope::Rt2ar,
    },
    Knob {
        name: "penumbra_radius",
        unit: "pixels to each side",
        range: "0 to 16",
        default: "1",
        error: "noise in penumbrae with few, blurred narrow ones with many",
        values: &["0", "1", "2"],
        scope: Scope::Rt2ar,
    },
];

/// How a captured world is prepared, from dear to cheap, for combinations: time and error of the preparation go together. Irradiance of
/// fewer samples saves little more and leaves noise of its own, which the filter takes for detail once the picture's is gone: errors
/// then rise with samples.
pub const PREPARATIONS: [&[(&str, &str)]; 3] = [
    &[],
    &[("irradiance_width", "256")],
    &[("irradiance_width", "128"), ("irradiance_samples", "4"), ("field_resolution", "128")],
];
/// Scattering events tried in combinations; all others are tried by themselves.
pub(super) const COMBINED_BOUNCES: [u32; 2] = [1, 3];

/// Where every knob stands.
#[derive(Clone, Debug, PartialEq)]
pub struct Choice {
    /// The method.
    pub method: Method,
    /// Samples a pixel.
    pub samples: u32,
    /// Scattering events.
    pub bounces: u32,
    /// Whether layers are filtered.
    pub denoise: bool,
    /// Knobs of `--set` that are not at their defaults, by name.
    pub settings: Vec<(&'static str, &'static str)>,
}

impl Choice {
    /// The same with one knob turned.
    ///
    /// # Errors
    /// [`Error::Unsupported`] for a value out of range.
    pub fn with(&self, knob: &Knob, value: &'static str) -> Result<Self> {
        let mut choice = self.clone();
        let bad = || Error::unsupported(format!("`{value}` is no value of `{}`", knob.name), knob.range);
        match knob.name {
            "samples" => choice.samples = value.parse().map_err(|_| bad())?,
            "bounces" => choice.bounces = value.parse().map_err(|_| bad())?,
            "denoise" => choice.denoise = value.parse().map_err(|_| bad())?,
            name => {
                Settings::default().set(name, value)?;
                choice.settings.retain(|(key, _)| *key != name);
                if value != knob.default {
                    choice.settings.push((name, value));
                }
            }
        }
        Ok(choice)
    }

    /// Where a knob stands.
    pub fn value_of(&self, knob: &Knob) -> String {
        match knob.name {
            "samples" => self.samples.to_string(),
            "bounces" => self.bounces.to_string(),
            "denoise" => self.denoise.to_string(),
            name => self.settings.iter().find(|(key, _)| *key == name).map_or(knob.default, |(_, value)| value).to_owned(),
        }
    }

    /// The same with the knobs of a [`PREPARATIONS`] entry turned.
    pub fn prepared(&self, turned: &[(&'static str, &'static str)]) -> Self {
        Self { settings: turned.to_vec(), ..self.clone() }
    }

    /// Puts all of it into a scene and the options it is rendered with.
    ///
    /// # Errors
    /// [`Error::Unsupported`] for a setting out of range.
    pub fn apply(&self, scene: &mut Scene, options: &mut RenderOptions) -> Result<()> {
        let Self { method, samples, bounces, denoise, settings } = self;
        (scene.render.method, scene.render.samples, scene.render.bounces) = (*method, *samples, *bounces);
        options.denoise = *denoise;
        settings.iter().try_for_each(|(key, value)| options.settings.set(key, value))
    }

    /// The options of `pano render` that ask for this.
    pub fn arguments(&self) -> String {
        let Self { method, samples, bounces, denoise, settings } = self;
        let mut text = format!("--method {} --samples {samples} --bounces {bounces}", method.name());
        if !denoise {
            text += " --no-denoise";
        }
        settings.iter().fold(text, |text, (key, value)| format!("{text} --set {key}={value}"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pipeline::SETTINGS;

    fn default_choice() -> Choice {
        Choice { method: Method::Dpt, samples: 64, bounces: 3, denoise: true, settings: vec![] }
    }

    fn applied(choice: &Choice) -> (Scene, RenderOptions) {
        let mut scene = Scene::parse("[panorama]\ncolor = 'pano.exr'\n", "scene.toml").unwrap();
        let mut options = RenderOptions::default();
        choice.apply(&mut scene, &mut options).unwrap();
        (scene, options)
    }

    #[test]
    fn every_value_is_accepted_and_the_default_changes_nothing() {
        for knob in KNOBS {
            assert!(knob.values.contains(&knob.default), "{}: the sweep has the default", knob.name);
            for value in knob.values {
                let choice = default_choice().with(knob, value).unwrap();
                applied(&choice);
                assert_eq!(choice == default_choice(), *value == knob.default, "{} = {value}", knob.name);
                assert_eq!(choice.value_of(knob), *value, "{}", knob.name);
            }
            let at_default = default_choice().with(knob, knob.default).unwrap();
            assert_eq!(applied(&at_default).1.settings, Settings::default(), "{}", knob.name);
        }
    }

    #[test]
    fn every_setting_is_a_knob_or_describes_the_scene() {
        // How depth is read, what real surfaces are made of, which light is looked for, what only sequences have, where stages
        // run, and the looks of a lens.
        let described = ["gap_contrast", "gap_relative", "reflectance_cap", "detector", "gloss", "gloss_roughness", "sparse"];
        let lens = ["bloom", "glare", "lens_threshold", "bloom_radius", "glare_attenuation", "glare_passes", "lens_light"];
        let described = [&described[..], &lens[..]].concat();
        for setting in SETTINGS {
            let known = described.contains(&setting.key)
                || setting.key.starts_with("gpu_")
                || KNOBS.iter().any(|k| k.name == setting.key);
            assert!(known, "{} is in no sweep", setting.key);
        }
    }

    #[test]
    fn preparations_are_settings() {
        PREPARATIONS.iter().for_each(|p| _ = applied(&default_choice().prepared(p)));
    }

    #[test]
    fn every_part_of_a_choice_is_applied() {
        let settings = vec![("irradiance_width", "128")];
        let choice = Choice { method: Method::Rt2ar, samples: 7, bounces: 5, denoise: false, settings };
        let (scene, options) = applied(&choice);
        let render = &scene.render;
        assert_eq!((render.method, render.samples, render.bounces), (Method::Rt2ar, 7, 5));
        assert!(!options.denoise && options.settings.captured.irradiance_width == 128);
    }

    #[test]
    fn arguments_are_those_of_the_command() {
        let knob = |name: &str| KNOBS.iter().find(|k| k.name == name).unwrap();
        let choice = default_choice().with(knob("mis"), "light").unwrap().with(knob("denoise"), "false").unwrap();
        assert_eq!(choice.arguments(), "--method dpt --samples 64 --bounces 3 --no-denoise --set mis=light");
    }
}
