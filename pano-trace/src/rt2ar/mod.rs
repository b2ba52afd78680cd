//! The tracer of RT²AR (Santos et al. 2012, "Real time ray tracing for augmented reality", sections III and IV): one pass of
//! recursive rays in which the nearest of virtual object, ghost and captured depth wins.
//!
//! - *Dual behaviour of real surfaces* (section III.B): a primary ray that meets one shows the photo, changed by the shadows
//!   and mirror images that the objects put there. A secondary ray that meets one sees its captured radiance, changed the
//!   same way, or shades it if its reflectance is known (a ghost).
//! - *Reflection and refraction* (B, D) branch into two rays at each clear surface, weighted by the exact Fresnel terms, to
//!   [`Params::depth`] surfaces one after the other. A refracted ray keeps a stack of the bodies it
//!   is in, up to eight; the one entered last counts.
//! - *Shadows* (E): each light is a sphere. [`Shadow::Adaptive`] sends [`Params::probes`] rays to its middle and its rim, and
//!   all others only where the probes disagree. A pixel's first ray probes; later ones that meet the same surface make sure
//!   with two probes ([`Params::samples`] rays together send more than one would).
//! - *Textures* (III.A) are filtered anisotropically over what a ray covers of them, by ray differentials.
//! - *The environment* (C) is a sphere around everything.
//!
//! *Departures*. Samples of a light are uniform over its disc as the shaded point sees it, not over the sphere, whose rim
//! would count too much; they are turned by a random angle per point, which the mean filter (`pano-denoise`'s `mean`) then
//! evens out. The photo carries real light already, so that a real surface shows the photo times (change of irradiance /
//! irradiance), where the paper subtracts colour. Normals come from the depth, which the paper left open: real surfaces mirror
//! objects, too ([`Params::gloss`]). Planar refraction is a sheet that does not bend light, as a real pane does not, where the
//! paper bends at each face. Shadow rays pass clear bodies on a straight line, dimmed by the factors and Fresnel terms of
//! their surfaces; the paper's stop there.
//!
//! *Additions*. [`Params::spread`] bounds the penumbrae that the probes miss: pixels beside one, or on the other side of an
//! edge, get all samples, again and again until nothing new is found. A light in an opening, and one that depth is known
//! of, stands at its distance, and [`place_lights`] says where.

mod frame;
#[cfg(feature = "gpu")]
pub mod gpu;
mod lights;
mod media;
mod shade;
mod shadow;
mod survey;
mod trail;

pub use frame::{Rendered, render};
pub use lights::{SphericalLight, place_lights};

use crate::mr360::Lighting;
use pano_core::image::RadianceImage;

/// How shadows of the lights are found.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Shadow {
    /// One ray to the middle of each light.
    Hard,
    /// All samples everywhere.
    Soft,
    /// All samples where a few probes disagree.
    #[default]
    Adaptive,
}

/// Least and largest number of probes.
pub const PROBES: [u32; 2] = [5, 64];
/// Largest number of samples of a light.
pub const MAX_SHADOW_SAMPLES: u32 = 256;

/// How a frame is traced.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Params<'a> {
    /// Primary rays a pixel, ≥ 1. More smooth edges; time grows linearly.
    pub samples: u32,
    /// How many reflections and refractions follow one another, ≥ 0; what lies beyond is taken from the environment. Two get
    /// into a glass body and out of it. Time can double with each.
    pub depth: u32,
    /// Shadows of the lights; without them lights shine through everything.
    pub shadows: bool,
    /// How shadows are found.
    pub shadow: Shadow,
    /// Samples of a light, [1, [`MAX_SHADOW_SAMPLES`]]: steps of a penumbra.
    pub shadow_samples: u32,
    /// Of these, the ones that decide whether there is a penumbra, [`PROBES`]. Fewer miss more of it.
    pub probes: u32,
    /// Whether pixels beside a penumbra get all samples as well.
    pub spread: bool,
    /// Strength of the mirror image of objects in real surfaces, [0, 1]: 0 is matt, 1 a polished floor.
    pub gloss: f32,
    /// Roughness of that mirror image, [0, 1].
    pub gloss_roughness: f32,
    /// Largest diffuse reflectance of real surfaces, [0, 1]: a shadow takes away at most what such a surface would send back.
    pub reflectance_cap: f32,
    /// Most lookups of a texture along the longer axis of what a ray covers of it, [0,
    /// [`MAX_ANISOTROPY`](pano_core::texture::MAX_ANISOTROPY)]: more are sharper at grazing angles. 0: textures are not filtered.
    pub max_anisotropy: u32,
    /// What the view shows without objects.
    pub photo: &'a RadianceImage,
}

impl<'a> Params<'a> {
    /// Adaptive shadows of 20 samples and five probes (section V.C), five secondary rays (table 1) and one more to leave a
    /// body that another one holds; matt real surfaces.
    pub const fn new(photo: &'a RadianceImage) -> Self {
        Self {
            samples: 16,
            depth: 6,
            shadows: true,
            shadow: Shadow::Adaptive,
            shadow_samples: 20,
            probes: PROBES[0],
            spread: true,
            gloss: 0.0,
            gloss_roughness: 0.3,
            reflectance_cap: 0.9,
            max_anisotropy: 16,
            photo,
        }
    }
}

#[cfg(test)]
mod tests;
