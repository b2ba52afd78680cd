//! One file a command.

mod compare;
mod demo;
mod expand;
mod info;
mod lights;
mod plan;
mod render;
mod tradeoff;

use crate::failure::Failure;

/// What `pano` can do.
#[derive(Debug, clap::Subcommand)]
pub(crate) enum Command {
    /// Show what this program does, in a room made in code: composites by each method, and the truth beside them
    Demo(demo::Args),
    /// Put the objects of a scene into its panorama
    Render(render::Args),
    /// Say which effects a scene calls for, which stages will run, why, and what each costs
    Plan(plan::Args),
    /// Show what accuracy costs in time: error against time for every knob, as tables, charts and a page
    Tradeoff(tradeoff::Args),
    /// Say how far two pictures are apart
    Compare(compare::Args),
    /// Say what panoramas, depth maps, meshes and scenes hold, and what is wrong with them
    Info(info::Args),
    /// Find the lights of a panorama
    Lights(lights::Args),
    /// Turn a picture of low dynamic range into radiance
    Expand(expand::Args),
}

impl Command {
    /// Runs the command.
    pub(crate) fn run(&self) -> Result<(), Failure> {
        match self {
            Self::Demo(args) => demo::run(args),
            Self::Render(args) => render::run(args),
            Self::Plan(args) => plan::run(args),
            Self::Tradeoff(args) => tradeoff::run(args),
            Self::Compare(args) => compare::run(args),
            Self::Info(args) => info::run(args),
            Self::Lights(args) => lights::run(args),
            Self::Expand(args) => expand::run(args),
        }
    }
}
