//! Depth as distance along the ray, and the conversion of everything else into it.
//!
//! Files hold depth in many ways: as distance along the ray, as distance along the optical axis (z), as disparity; in
//! metres, millimetres or fractions of a metre; with this or that code for "nothing there". A [`DepthFormat`] declares
//! it and [`RayDepth::from_raw`] converts once, on loading. Past that point there is only [`RayDepth`].

use crate::camera::Projection;
use crate::image::Image;
use crate::{Error, Result};
use glam::Vec2;

/// From this distance on (metres) a surface counts as being at infinity.
pub const FAR: f32 = 1e9;

/// What a stored depth value measures.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum DepthKind {
    /// Distance along the ray.
    #[default]
    Ray,
    /// Distance along the optical axis. Exists only in perspective pictures: a panorama has no axis.
    Z,
    /// Inverse distance: `scale / value`, in metres, is z in a perspective picture (as in a rectified stereo pair, with
    /// scale = focal length in pixels × baseline in metres) and the distance along the ray in a panorama.
    Disparity,
}

impl DepthKind {
    /// The name used in scene files and in the EXR attribute `pano:depth_kind`.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Ray => "ray",
            Self::Z => "z",
            Self::Disparity => "disparity",
        }
    }

    /// The kind of that [`DepthKind::name`].
    pub fn from_name(name: &str) -> Option<Self> {
        [Self::Ray, Self::Z, Self::Disparity].into_iter().find(|kind| kind.name() == name)
    }
}

/// How a depth file's numbers are to be read.
#[derive(Clone, Debug, PartialEq)]
pub struct DepthFormat {
    /// What a value measures.
    pub kind: DepthKind,
    /// Metres per unit of the stored value, > 0. For [`DepthKind::Disparity`]: metres × the stored unit.
    pub scale: f32,
    /// Stored values (before scaling) that mean "nothing there", besides 0, negative, NaN, infinite and ≥ 10⁹ m, which
    /// always do.
    pub invalid: Vec<f32>,
}

impl Default for DepthFormat {
    /// The preset `exr`.
    fn default() -> Self {
        Self { kind: DepthKind::Ray, scale: 1.0, invalid: Vec::new() }
    }
}

impl DepthFormat {
    /// Names of the presets.
    pub const PRESETS: [&str; 5] = ["exr", "mm", "stanford2d3ds", "kitti", "kinect"];

    /// The preset of that name:
    ///
    /// | name | kind | metres per unit | invalid |
    /// |---|---|---|---|
    /// | `exr` | ray | 1 | 0 |
    /// | `mm` | ray | 1/1000 | 0 |
    /// | `stanford2d3ds` | ray (its panoramas store distance from the camera's centre) | 1/512 | 65535, 0 |
    /// | `kitti` | z | 1/256 | 0 |
    /// | `kinect` | z | 1/1000 | 0 |
    pub fn preset(name: &str) -> Option<Self> {
        let (kind, scale, invalid) = match name {
            "exr" => (DepthKind::Ray, 1.0, vec![]),
            "mm" => (DepthKind::Ray, 1.0 / 1000.0, vec![]),
            "stanford2d3ds" => (DepthKind::Ray, 1.0 / 512.0, vec![65535.0]),
            "kitti" => (DepthKind::Z, 1.0 / 256.0, vec![]),
            "kinect" => (DepthKind::Z, 1.0 / 1000.0, vec![]),
            _ => return None,
        };
        Some(Self { kind, scale, invalid })
    }

    /// Checks the scale.
    ///
    /// # Errors
    /// [`Error::Argument`] if it is not a positive finite number.
    pub fn validate(&self) -> Result<()> {
        if self.scale > 0.0 && self.scale.is_finite() {
            return Ok(());
        }
        Err(Error::argument(format!("a depth format's scale is a positive finite number, not {}", self.scale)))
    }

    /// Metres (along ray or axis, as the kind says) of one stored value; infinite where nothing is there.
    fn metres(&self, stored: f32) -> f32 {
        if self.invalid.contains(&stored) {
            return f32::INFINITY;
        }
        valid_or_infinite(match self.kind {
            DepthKind::Ray | DepthKind::Z => stored * self.scale,
            // 0 and negative disparities are nothing; 1/x alone would map −0 and inf to something else.
            DepthKind::Disparity if stored > 0.0 => self.scale / stored,
            DepthKind::Disparity => f32::INFINITY,
        })
    }
}

/// `metres` if something can be at that distance, else infinity.
#[inline]
fn valid_or_infinite(metres: f32) -> f32 {
    if metres > 0.0 && metres < FAR { metres } else { f32::INFINITY }
}

/// Distance along the ray in metres for every pixel: in (0, 10⁹), or infinite where nothing is there.
#[derive(Clone, Debug, PartialEq)]
pub struct RayDepth(Image<f32>);

impl RayDepth {
    /// Takes distances along the ray in metres; 0, negative, NaN, infinite and ≥ 10⁹ become infinite.
    pub fn from_metres(mut metres: Image<f32>) -> Self {
        metres.data_mut().iter_mut().for_each(|d| *d = valid_or_infinite(*d));
        Self(metres)
    }

    /// Converts stored values of the given format, seen by a camera of the given projection.
    ///
    /// # Errors
    /// [`Error::Argument`] for z-depth in a panorama, where no axis exists to measure it along; for a scale that is not
    /// positive; for a vertical field of view outside (0, π).
    pub fn from_raw(mut raw: Image<f32>, format: &DepthFormat, projection: Projection) -> Result<Self> {
        format.validate()?;
        let (width, height) = raw.size();
        // Where the axis is, and how far a pixel is from the next at z = 1, if depth is along the axis.
        let intrinsics = match (format.kind, projection) {
            (DepthKind::Ray, _) | (DepthKind::Disparity, Projection::Panorama) => None,
            (DepthKind::Z, Projection::Panorama) => {
                return Err(Error::argument(format!(
                    "z-depth needs an optical axis and a panorama has none; declare its depth as distance along the ray, \
                     for instance {{ kind = \"ray\", scale = {} }}",
                    format.scale
                )));
            }
            (DepthKind::Z | DepthKind::Disparity, Projection::Perspective { vfov })
                if !(vfov > 0.0 && vfov < std::f32::consts::PI) =>
            {
                return Err(Error::argument(format!("a vertical field of view lies in (0, π), not {vfov} radians")));
            }
            (DepthKind::Z | DepthKind::Disparity, Projection::Pinhole { focal, .. })
                if !(focal.cmpgt(Vec2::ZERO).all() && focal.is_finite()) =>
            {
                return Err(Error::argument(format!("focal lengths are positive numbers of pixels, not {focal}")));
            }
            (DepthKind::Z | DepthKind::Disparity, projection) => projection.intrinsics((width, height)),
        };
        for (i, d) in raw.data_mut().iter_mut().enumerate() {
            let metres = format.metres(*d);
            *d = valid_or_infinite(match intrinsics {
                None => metres,
                Some((focal, center)) => {
                    let at = Vec2::new((i % width) as f32 + 0.5, (i / width) as f32 + 0.5);
                    metres * (1.0 + ((at - center) / focal).length_squared()).sqrt()
                }
            });
        }
        Ok(Self(raw))
    }

    /// The distances.
    pub fn image(&self) -> &Image<f32> {
        &self.0
    }

    /// The distances, without the type.
    pub fn into_image(self) -> Image<f32> {
        self.0
    }

    /// `(width, height)`.
    pub fn size(&self) -> (usize, usize) {
        self.0.size()
    }

    /// Distance at `(x, y)` in metres; infinite where nothing is there.
    #[inline]
    pub fn get(&self, x: usize, y: usize) -> f32 {
        self.0.get(x, y)
    }

    /// How many pixels have something at a finite distance.
    pub fn finite_pixels(&self) -> usize {
        self.0.data().iter().filter(|d| d.is_finite()).count()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::Camera;
    use glam::{Quat, Vec2, Vec3};
    use proptest::prelude::*;

    const INF: f32 = f32::INFINITY;

    fn one(stored: f32, format: &DepthFormat, projection: Projection) -> f32 {
        RayDepth::from_raw(Image::filled(1, 1, stored), format, projection).unwrap().get(0, 0)
    }

    #[test]
    fn presets_convert_their_codes() {
        let perspective = Projection::Perspective { vfov: 1e-3 };
        let table = [
            ("exr", 2.5, 2.5),
            ("mm", 2500.0, 2.5),
            ("mm", 0.0, INF),
            ("mm", 65535.0, 65.535),
            ("stanford2d3ds", 512.0, 1.0),
            ("stanford2d3ds", 65535.0, INF),
            ("stanford2d3ds", 0.0, INF),
            ("kitti", 2560.0, 10.0),
            ("kitti", 0.0, INF),
        ];
        for (name, stored, metres) in table {
            let got = one(stored, &DepthFormat::preset(name).unwrap(), perspective);
            assert!(got == metres || (got / metres - 1.0).abs() < 1e-6, "{name} {stored}: {got} instead of {metres}");
        }
        for name in DepthFormat::PRESETS {
            assert!(DepthFormat::preset(name).is_some(), "{name}");
        }
        assert_eq!(DepthFormat::preset("inch"), None);
        assert_eq!(DepthFormat::preset("exr"), Some(DepthFormat::default()));
    }

    #[test]
    fn nothing_there_is_infinite_in_every_kind() {
        for kind in [DepthKind::Ray, DepthKind::Disparity] {
            let format = DepthFormat { kind, scale: 1.0, invalid: vec![7.0] };
            for stored in [0.0, -0.0, -1.0, f32::NAN, f32::NEG_INFINITY, 7.0] {
                assert_eq!(one(stored, &format, Projection::Panorama), INF, "{kind:?} {stored}");
            }
        }
        let ray = DepthFormat::default();
        for (stored, want) in [(INF, INF), (1e9, INF), (9.99e8, 9.99e8), (1e-6, 1e-6)] {
            assert_eq!(one(stored, &ray, Projection::Panorama), want, "{stored}");
        }
        let disparity = DepthFormat { kind: DepthKind::Disparity, scale: 2.0, invalid: vec![] };
        for (stored, want) in [(INF, INF), (1e-30, INF), (4.0, 0.5)] {
            assert_eq!(one(stored, &disparity, Projection::Panorama), want, "{stored}");
        }
    }

    #[test]
    fn z_in_a_panorama_and_bad_numbers_are_refused() {
        let raw = Image::filled(2, 1, 1.0);
        let kitti = DepthFormat::preset("kitti").unwrap();
        let message = RayDepth::from_raw(raw.clone(), &kitti, Projection::Panorama).unwrap_err().to_string();
        assert!(message.contains("optical axis") && message.contains("ray"), "{message}");
        for scale in [0.0, -1.0, f32::NAN, INF] {
            let format = DepthFormat { scale, ..DepthFormat::default() };
            assert!(RayDepth::from_raw(raw.clone(), &format, Projection::Panorama).is_err(), "{scale}");
        }
        for vfov in [0.0, 4.0, f32::NAN] {
            assert!(RayDepth::from_raw(raw.clone(), &kitti, Projection::Perspective { vfov }).is_err(), "{vfov}");
        }
    }

    #[test]
    fn kinds_have_names() {
        for kind in [DepthKind::Ray, DepthKind::Z, DepthKind::Disparity] {
            assert_eq!(DepthKind::from_name(kind.name()), Some(kind));
        }
        assert_eq!(DepthKind::from_name("Z"), None);
    }

    proptest! {
        /// A wall at constant z: the point on every ray has that z.
        #[test]
        fn z_becomes_distance_along_the_camera_ray(
            w in 1usize..9, h in 1usize..9, vfov in 0.1f32..2.8, z in 0.01f32..100.0, disparity: bool,
        ) {
            let (kind, stored) = if disparity { (DepthKind::Disparity, 1.0 / z) } else { (DepthKind::Z, z) };
            let projection = Projection::Perspective { vfov };
            let format = DepthFormat { kind, scale: 1.0, invalid: vec![] };
            let depth = RayDepth::from_raw(Image::filled(w, h, stored), &format, projection).unwrap();
            let camera = Camera { position: Vec3::ZERO, world_from_camera: Quat::IDENTITY, projection, width: w, height: h };
            for y in 0..h {
                for x in 0..w {
                    let point = camera.direction(Vec2::new(x as f32 + 0.5, y as f32 + 0.5)) * depth.get(x, y);
                    prop_assert!((-point.z / z - 1.0).abs() < 1e-4, "({x}, {y}): {point} for z = {z}");
                }
            }
        }
    }
}
