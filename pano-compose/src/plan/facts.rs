//! What the plan needs to know of a scene.

use pano_core::material::Material;

/// Facts about a scene and how it is to be rendered. The default is a scene without objects.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct SceneFacts {
    /// Virtual objects in the scene.
    pub objects: usize,
    /// Any object's material has a specular lobe; see [`is_glossy`].
    pub glossy: bool,
    /// Any object's material lets light through; see [`is_transmissive`].
    pub transmission: bool,
    /// Scattering events allowed after the camera; 1 is direct light only.
    pub bounces: u32,
    /// The panorama has depth.
    pub has_depth: bool,
    /// The back faces at depth gaps are switched off.
    pub no_back_faces: bool,
    /// Sparse tracing is switched off.
    pub no_sparse: bool,
    /// Bloom or glare is asked for.
    pub lens: bool,
    /// There are proxies or a ground plane.
    pub has_proxies: bool,
    /// There is more than one frame.
    pub is_sequence: bool,
    /// Any object has keyframes.
    pub moving: bool,
    /// Lights that stand out of the panorama, if the method looks for them.
    pub lights: Option<usize>,
    /// Name of the method that will run, as in the scene file (`auto` already decided).
    pub method: String,
}

impl SceneFacts {
    /// Takes the facts of one more object with `material` into account; call it once an object and material.
    pub fn note_material(&mut self, material: &Material) {
        self.glossy |= is_glossy(material);
        self.transmission |= is_transmissive(material);
    }

    /// Whether any real surface is known that an object could change.
    pub(super) fn has_receivers(&self) -> bool {
        self.has_depth || self.has_proxies
    }
}

/// Whether the material has a specular lobe, of any roughness: it is a metal, or a dielectric with `specular` above 0 that
/// differs from air. At roughness 1 the lobe is wide, not gone.
pub fn is_glossy(material: &Material) -> bool {
    material.metallic > 0.0 || (material.specular > 0.0 && material.ior > 1.0 && material.specular_color.max_element() > 0.0)
}

/// Whether the material lets light through. A metal never does.
pub fn is_transmissive(material: &Material) -> bool {
    material.transmission > 0.0 && material.metallic < 1.0
}
