//! The tracer of MR360 (Rhee et al. 2017, sections 3, 4 and 6): objects lit by convolved maps and by the few lights that
//! cast visible shadows, real surfaces that take the photo for their colour.
//!
//! - An object's diffuse and glossy reflection are lookups in [`RadianceMaps`], its perfect mirrors look at the panorama
//!   itself. The lights come on top, each blocked by rays towards its disc.
//! - A real surface shows L_photo·(E′/E), with E the irradiance from maps and lights without the objects, E′ with them. One
//!   rendering gives both (section 6.4): what is blocked is subtracted as it is found. Where the surface is declared glossy,
//!   it reflects objects, too.
//! - Ambient occlusion is one ray a sample over the hemisphere.
//!
//! *Departures*: the paper's shadow maps and screen-space effects are rays here. A ray of ambient occlusion that meets an object
//! takes away what the clamped map shows behind it and adds what the object sends, at most as much, where the paper darkens all directions
//! alike; that gives contact shadows their direction and colour bleeding. Objects seen in objects are shaded once, without
//! rays of their own for ambient light.

mod frame;
#[cfg(feature = "gpu")]
pub mod gpu;
mod shade;

pub use frame::{Lit, render};

use glam::{Quat, Vec3};
use pano_core::image::RadianceImage;
use pano_core::light::{DirectionalLight, RadianceMaps};

/// What lights a frame.
#[derive(Clone, Debug)]
pub struct Lighting {
    /// The panorama without its lights, convolved; in the panorama's frame.
    pub maps: RadianceMaps,
    /// The lights, with directions in the world. [`DirectionalLight::intensity`] counts.
    pub lights: Vec<DirectionalLight>,
    /// Turns the world into the panorama's frame.
    pub pano_from_world: Quat,
    /// Where the panorama was captured.
    pub capture: Vec3,
}

/// How a frame is shaded.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Params<'a> {
    /// Samples a pixel, ≥ 1. Noise of penumbrae and ambient occlusion falls with the root, time grows linearly.
    pub samples: u32,
    /// Shadows of the lights; without them lights shine through everything.
    pub shadows: bool,
    /// Ambient occlusion.
    pub ambient_occlusion: bool,
    /// Strength of the mirror image of objects in real surfaces, [0, 1]: 0 is matt, 1 a polished floor.
    pub gloss: f32,
    /// Roughness of that mirror image, [0, 1].
    pub gloss_roughness: f32,
    /// What the view shows without objects.
    pub photo: &'a RadianceImage,
}

#[cfg(test)]
mod tests;
