//! `pano render`: a scene to pictures.

mod args;
mod target;

pub(crate) use args::Args;

use crate::{failure::Failure, output, progress::Console};
use pano_compose::pipeline::{self, RenderOptions, Sequence, Stats};
use pano_compose::tradeoff::{self, Chosen, Goal};
use pano_core::{
    Error, io,
    progress::Progress,
    scene::{PicturePath, Scene},
};
use serde::Serialize;
use std::collections::BTreeSet;
use target::Target;

/// What `--stats` writes for more than one frame.
#[derive(Debug, Serialize)]
struct SequenceStats {
    frames: Vec<FrameStats>,
}

/// One frame of it.
#[derive(Debug, Serialize)]
struct FrameStats {
    frame: u32,
    #[serde(flatten)]
    stats: Stats,
}

/// Runs the command.
pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    let mut scene = Scene::load(&args.scene)?;
    args.apply(&mut scene.render);
    let frames = frames(args, &scene)?;
    let target = Target::new(&args.output, frames.len())?;
    // What cannot be written is said before the work, not after it.
    target.check(&frames)?;
    args.stats.as_deref().map_or(Ok(()), target::check_writable)?;

    let console = Console::new();
    let mut options = args.options();
    let chosen = args.goal().map(|goal| choose(args, goal, &mut scene, &mut options, &console)).transpose()?;
    let mut sequence = Sequence::new(&scene, &options);
    let mut all = vec![];
    let mut told = BTreeSet::new();
    for &frame in &frames {
        if frames.len() > 1 {
            console.frame(frame);
        }
        let rendered = sequence.render(frame, &console)?;
        for warning in &rendered.stats.warnings {
            // Every frame of a sequence may have the same to say.
            if told.insert(warning.clone()) {
                console.message(&format!("warning: {warning}"));
            }
        }
        if let Some(adapter) = &rendered.stats.adapter
            && told.insert(adapter.clone())
        {
            console.message(&format!("stages ran on {adapter}"));
        }
        if console.cancelled() {
            return Err(pipeline::Error::Cancelled.into());
        }
        pipeline::write_output(&target.path(frame), &rendered)?;
        all.push(FrameStats { frame, stats: rendered.stats });
    }
    drop(console);
    if let (Some(chosen), Some(last)) = (chosen, all.last()) {
        let expected = chosen.expected_ms;
        output::message(&format!("took {:.0} ms, {expected:.0} ms were expected", last.stats.total_ms));
    }
    report(args, all)
}

/// Puts the settings that reach `goal` into scene and options, and says which they are.
fn choose(args: &Args, goal: Goal, scene: &mut Scene, options: &mut RenderOptions, console: &Console) -> Result<Chosen, Failure> {
    let chosen = tradeoff::choose(scene, goal, args.denoise(), console)?;
    chosen.choice.apply(scene, options)?;
    let error = chosen.expected_error.map_or(String::new(), |e| format!(", error {e:.4}"));
    console.message(&format!("chose {}; expecting {:.0} ms{error}", chosen.choice.arguments(), chosen.expected_ms));
    if let Some(caveat) = &chosen.caveat {
        console.message(&format!("warning: the goal is out of reach: {caveat}"));
    }
    Ok(chosen)
}

/// The frames to render: those asked for; all that are there of a sequence; 0 for a still.
fn frames(args: &Args, scene: &Scene) -> Result<Vec<u32>, Failure> {
    if let Some(range) = &args.frames {
        return Ok(range.clone().collect());
    }
    let PicturePath::Frames(pattern) = &scene.panorama.color else { return Ok(vec![0]) };
    let frames = pattern.existing();
    if frames.is_empty() {
        let problem = format!("no frame of the sequence is there, such as {}", pattern.path(0).display());
        return Err(Error::file(&scene.path, problem, "check `frames` in [panorama]").into());
    }
    Ok(frames)
}

/// Writes `--stats` and prints `--json`.
fn report(args: &Args, mut all: Vec<FrameStats>) -> Result<(), Failure> {
    let json = match all.len() {
        1 => serde_json::to_string_pretty(&all.remove(0).stats),
        _ => serde_json::to_string_pretty(&SequenceStats { frames: all }),
    };
    let json = json.map_err(|e| Error::argument(format!("the statistics cannot be written as JSON: {e}")))? + "\n";
    if let Some(path) = &args.stats {
        io::write_text(path, &json)?;
    }
    if args.json { output::print(&json) } else { Ok(()) }
}
