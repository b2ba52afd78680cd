//! The arguments of `pano render`, checked while they are parsed: what is wrong here is wrong usage.

use clap::builder::{PossibleValuesParser, TypedValueParser};
use pano_compose::pipeline::{Backend, RenderOptions, SETTINGS, Settings};
use pano_compose::tradeoff::Goal;
use pano_core::scene::{Method, Render};
use std::{ops::RangeInclusive, path::PathBuf};

/// Most frames of one run; beyond it is a slip of the keyboard.
const MAX_FRAMES: u32 = 1_000_000;

/// Arguments of `pano render`.
#[derive(Debug, clap::Args)]
#[command(after_help = settings_help())]
pub(crate) struct Args {
    /// Scene file (TOML)
    pub(super) scene: PathBuf,
    /// Picture to write: .exr holds all layers, .png .jpg .hdr .pfm the composite; out_%04d.exr for more than one frame
    #[arg(short, long, value_name = "OUT")]
    pub(super) output: PathBuf,
    /// Method, instead of the scene's
    #[arg(long, value_parser = method_parser())]
    method: Option<Method>,
    /// Samples a pixel, instead of the scene's
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=i64::from(Render::MAX_SAMPLES)))]
    samples: Option<u32>,
    /// Scattering events after the camera, instead of the scene's; 1 is direct light only
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=i64::from(Render::MAX_BOUNCES)))]
    bounces: Option<u32>,
    /// Choose the samples (and how a captured world is prepared) so that a frame takes about this long: 50ms, 2s, 1min
    #[arg(long, value_name = "TIME", value_parser = parse_time, conflicts_with_all = ["samples", "error"])]
    budget: Option<f64>,
    /// Choose the samples so that the error is about this: root mean square of display-encoded values where objects change them
    #[arg(long, value_name = "E", value_parser = parse_error, conflicts_with = "samples")]
    error: Option<f64>,
    /// Where to compute
    #[arg(long, default_value = "auto", value_parser = backend_parser())]
    backend: Backend,
    /// Frames to render, first and last; left out: all frames of a sequence that are there
    #[arg(long, value_name = "A-B", value_parser = parse_frames)]
    pub(super) frames: Option<RangeInclusive<u32>>,
    /// Changes all random numbers
    #[arg(long, value_name = "N", default_value_t = 0)]
    seed: u32,
    /// Leave the traced layers unfiltered
    #[arg(long)]
    no_denoise: bool,
    /// Turn a knob (listed below); may be given more than once
    #[arg(long = "set", value_name = "KEY=VALUE", value_parser = parse_setting)]
    settings: Vec<(String, String)>,
    /// Turn an effect on or off whatever the scene calls for; may be given more than once
    #[arg(long = "force", value_name = "EFFECT=on|off", value_parser = parse_force)]
    forced: Vec<(String, bool)>,
    /// Write what was done and how long it took, as JSON
    #[arg(long, value_name = "FILE")]
    pub(super) stats: Option<PathBuf>,
    /// Print the same as one JSON object
    #[arg(long)]
    pub(super) json: bool,
}

impl Args {
    /// Puts the arguments over the scene's own.
    pub(super) fn apply(&self, render: &mut Render) {
        if let Some(method) = self.method {
            // A scene that says nothing of bounces has the default of its own method.
            if render.bounces == render.method.default_bounces() {
                render.bounces = method.default_bounces();
            }
            render.method = method;
        }
        render.samples = self.samples.unwrap_or(render.samples);
        render.bounces = self.bounces.unwrap_or(render.bounces);
    }

    /// What is to be reached, if that is asked for.
    pub(super) fn goal(&self) -> Option<Goal> {
        self.budget.map(Goal::Time).or(self.error.map(Goal::Error))
    }

    /// Whether layers are filtered.
    pub(super) fn denoise(&self) -> bool {
        !self.no_denoise
    }

    /// What the pipeline is told.
    pub(super) fn options(&self) -> RenderOptions {
        let mut settings = Settings::default();
        for (key, value) in &self.settings {
            // Each was tried on its own when it was parsed, and knobs do not depend on each other.
            let _ = settings.set(key, value);
        }
        let (denoise, backend, seed) = (self.denoise(), self.backend, self.seed);
        let mut options = RenderOptions { denoise, backend, seed, settings, ..RenderOptions::default() };
        for (effect, on) in &self.forced {
            // The same holds for effects.
            let _ = options.force(effect, *on);
        }
        options
    }
}

fn method_parser() -> impl TypedValueParser<Value = Method> {
    PossibleValuesParser::new(Method::ALL.map(Method::name)).try_map(|name| name.parse::<Method>())
}

fn backend_parser() -> impl TypedValueParser<Value = Backend> {
    PossibleValuesParser::new(["auto", "gpu", "cpu"]).map(|name| match name.as_str() {
        "gpu" => Backend::Gpu,
        "cpu" => Backend::Cpu,
        _ => Backend::Auto,
    })
}

/// `a-b` or `a`.
fn parse_frames(text: &str) -> Result<RangeInclusive<u32>, String> {
    let (first, last) = text.split_once('-').unwrap_or((text, text));
    let number = |text: &str| text.parse::<u32>().map_err(|_| "write it like 1-24 or 7".to_owned());
    let (first, last) = (number(first)?, number(last)?);
    match last.checked_sub(first) {
        None => Err("the last frame comes before the first".into()),
        Some(n) if n >= MAX_FRAMES => Err(format!("more than {MAX_FRAMES} frames")),
        Some(_) => Ok(first..=last),
    }
}

/// Milliseconds of `50ms`, `2s`, `1.5min`.
fn parse_time(text: &str) -> Result<f64, String> {
    let units = [("ms", 1.0), ("min", 60e3), ("s", 1e3)];
    let found = units.iter().find_map(|(unit, ms)| Some(text.strip_suffix(unit)?.trim().parse::<f64>().ok()? * ms));
    found.filter(|ms| (0.1..=1e9).contains(ms)).ok_or_else(|| "write it like 50ms, 2s or 1.5min".into())
}

/// An error in (0, 1].
fn parse_error(text: &str) -> Result<f64, String> {
    text.parse::<f64>().ok().filter(|e| *e > 0.0 && *e <= 1.0).ok_or_else(|| "write it like 0.02, above 0 and at most 1".into())
}

/// `key=value`, tried on settings of its own.
fn parse_setting(text: &str) -> Result<(String, String), String> {
    let (key, value) = text.split_once('=').ok_or("write it like key=value")?;
    let (key, value) = (key.trim(), value.trim());
    match Settings::default().set(key, value) {
        Ok(()) => Ok((key.to_owned(), value.to_owned())),
        Err(e) => Err(e.remedy().map_or(e.to_string(), |remedy| format!("{e}: {remedy}"))),
    }
}

/// `effect=on`, tried on options of its own.
fn parse_force(text: &str) -> Result<(String, bool), String> {
    let (effect, state) = text.split_once('=').ok_or("write it like effect=off")?;
    let on = match state.trim() {
        "on" => true,
        "off" => false,
        _ => return Err("say on or off".into()),
    };
    match RenderOptions::default().force(effect.trim(), on) {
        Ok(()) => Ok((effect.trim().to_owned(), on)),
        Err(e) => Err(e.remedy().map_or(e.to_string(), |remedy| format!("{e}: {remedy}"))),
    }
}

fn settings_help() -> String {
    let width = SETTINGS.iter().map(|s| s.key.len()).max().unwrap_or(0);
    let line = |key: &str, help: &str| format!("  {key:width$}  {help}\n");
    let lines: String = SETTINGS.iter().map(|s| line(s.key, s.help)).collect();
    format!("Knobs for --set:\n{}", lines.trim_end())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_are_parsed() {
        assert_eq!(parse_frames("7"), Ok(7..=7));
        assert_eq!(parse_frames("1-24"), Ok(1..=24));
        for text in ["", "-", "1-", "-1", "a-b", "5-4", "0-1000000", "1--2", "99999999999"] {
            assert!(parse_frames(text).is_err(), "{text}");
        }
    }

    #[test]
    fn effects_are_forced_by_name() {
        assert_eq!(parse_force("influence=off"), Ok(("influence".into(), false)));
        for text in ["", "influence", "influence=", "influence=maybe", "frob=on", "glossy=on"] {
            assert!(parse_force(text).is_err(), "{text}");
        }
    }

    #[test]
    fn times_have_units() {
        assert_eq!(["50ms", "2s", "1.5min", "0.2 s"].map(parse_time), [Ok(50.0), Ok(2e3), Ok(90e3), Ok(200.0)]);
        for text in ["", "5", "ms", "-1s", "nan s", "infs", "1h"] {
            assert!(parse_time(text).is_err(), "{text}");
        }
        assert!(parse_error("0").is_err() && parse_error("1.1").is_err() && parse_error("nan").is_err());
    }

    #[test]
    fn settings_are_tried() {
        for setting in ["", "mis", "=", "mis=", "mis=sometimes", "frob=1", "reflectance_cap=nan"] {
            assert!(parse_setting(setting).is_err(), "{setting}");
        }
        assert_eq!(parse_setting(" mis = light"), Ok(("mis".into(), "light".into())));
        assert!(parse_setting("frob=1").unwrap_err().contains("mis"), "the remedy lists the known knobs");
    }
}
