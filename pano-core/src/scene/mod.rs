//! The scene file: TOML that names a panorama, what is known of the real place, the virtual objects, the view and how to
//! render it.
//!
//! [`Scene::load`] checks everything that can be checked without opening another file, so that a [`Scene`] holds usable
//! values only. Faults come back as [`Error::Scene`] with line, column and byte span of the key or
//! value at fault, and a remedy. Unknown keys are faults.
//!
//! ```
//! use pano_core::scene::{Method, Scene};
//!
//! let scene = Scene::parse(
//!     r#"
//!     [panorama]
//!     color = "room.exr"
//!
//!     [[object]]
//!     mesh = "bunny.ply"
//!     position = [0.0, 0.0, -1.0]
//!     "#,
//!     "place/scene.toml",
//! )?;
//! assert_eq!(scene.panorama.color.path(0), std::path::Path::new("place/room.exr"));
//! assert_eq!(scene.render.method, Method::Auto);
//!
//! let error = Scene::parse("[panorama]\ncolour = 'room.exr'", "scene.toml").unwrap_err();
//! assert_eq!(error.to_string(), "scene.toml:2:1: unknown key `colour` in [panorama]");
//! assert_eq!(error.remedy(), Some("did you mean `color`?"));
//! # Ok::<(), pano_core::Error>(())
//! ```

mod method;
mod parse;
mod paths;
mod placement;
mod reader;
#[cfg(test)]
mod tests;

pub use method::Method;
pub use paths::{FramePattern, PicturePath};
pub use placement::{Keyframe, Placement, Rotation};

use crate::{
    Error, Result,
    camera::{Camera, Projection, rotation_from_yaw_pitch},
    depth::DepthFormat,
    file,
    material::Material,
    sphere::Convention,
};
use glam::{Quat, Vec2, Vec3};
use std::path::{Path, PathBuf};

/// Largest scene file that is read, in bytes. A scene names files and holds a few numbers an object; a larger file is
/// something else.
const MAX_SCENE_BYTES: u64 = 16 << 20;

/// A scene file, validated. Paths are already relative to the scene file's folder.
#[derive(Clone, Debug)]
pub struct Scene {
    /// Where the scene was read from.
    pub path: PathBuf,
    /// `[panorama]`: the captured place.
    pub panorama: Panorama,
    /// `[camera]`: a perspective picture with depth of a part of the place.
    pub camera: Option<DepthCamera>,
    /// `[[proxy]]`: known real geometry.
    pub proxies: Vec<Proxy>,
    /// `[[marker]]`: printed markers that objects stand on.
    pub markers: Vec<Marker>,
    /// `[[object]]`: virtual objects.
    pub objects: Vec<Object>,
    /// `[view]`; left out: the whole panorama.
    pub view: View,
    /// `[render]`.
    pub render: Render,
}

/// `[panorama]`: the captured place.
#[derive(Clone, Debug, PartialEq)]
pub struct Panorama {
    /// `color` (one picture) or `frames` (a sequence).
    pub color: PicturePath,
    /// `depth`; left out: everything is at infinity, unless proxies or a ground say otherwise. Numbered only where `color`
    /// is.
    pub depth: Option<PicturePath>,
    /// How to read `depth`. Default: the preset `exr`.
    pub depth_format: DepthFormat,
    /// World position of the capture point, metres. Default: the origin.
    pub position: Vec3,
    /// Degrees; the picture's centre looks this much further to the right than `convention` says. Default 0.
    pub heading: f32,
    /// Which way the picture's centre looks. Default: −Z.
    pub convention: Convention,
    /// Metres, positive: a ground plane lies this far below the capture point where there is no depth.
    pub camera_height: Option<f32>,
    /// Frames per second of a sequence, positive. Default 30.
    pub fps: f32,
}

impl Panorama {
    /// Rotates directions of the picture (its centre looking to −Z) into the world.
    pub fn world_from_pano(&self) -> Quat {
        rotation_from_yaw_pitch(self.heading + self.convention.center_yaw(), 0.0)
    }
}

/// `[camera]`: a depth camera, beside the panorama or instead of one. What it does not see is the panorama; without a
/// panorama, an estimate from its own picture.
#[derive(Clone, Debug, PartialEq)]
pub struct DepthCamera {
    /// `color`: its picture, EXR/HDR linear, PNG/JPEG sRGB. Numbered only where the panorama's is, or without a panorama.
    pub color: PicturePath,
    /// `depth`: of the same size. Numbered where `color` is.
    pub depth: PicturePath,
    /// How to read `depth`. Default: z in metres; of 16-bit PNGs in millimetres the preset `kinect`.
    pub depth_format: DepthFormat,
    /// `vfov`, or `fx`, `fy`, `cx` and `cy`.
    pub intrinsics: Intrinsics,
    /// World position of its eye, metres. Default: the panorama's capture point.
    pub position: Vec3,
    /// Where it looks: `yaw` degrees to the right of −Z, then `pitch` degrees up, then turned by `roll` degrees clockwise as it
    /// sees the world; or `rotation`, a quaternion that takes its frame (looking to −Z, +Y up) to the world. Default: to −Z.
    pub rotation: Quat,
    /// What a panorama's radiance is multiplied by to be in the units of this picture. Default 1.
    pub exposure: f32,
    /// There is no `[panorama]`: [`Scene::panorama`] names this camera's picture and stands where it stands.
    pub alone: bool,
}

/// How a depth camera's pixels are seen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Intrinsics {
    /// `vfov`: vertical field of view in degrees, (0, 180), of square pixels about the picture's middle. Default 45.
    Vfov(f32),
    /// Measured, in pixels.
    Pixels {
        /// `fx` and `fy`, positive; `fy` left out: as `fx`.
        focal: Vec2,
        /// `cx` and `cy`, the centre of the top left pixel being (½, ½); left out: the picture's middle.
        center: [Option<f32>; 2],
    },
}

impl DepthCamera {
    /// The camera of a picture of this size.
    pub fn camera(&self, (width, height): (usize, usize)) -> Camera {
        let projection = match self.intrinsics {
            Intrinsics::Vfov(vfov) => Projection::Perspective { vfov: vfov.to_radians() },
            Intrinsics::Pixels { focal, center: [x, y] } => {
                let center = Vec2::new(x.unwrap_or(0.5 * width as f32), y.unwrap_or(0.5 * height as f32));
                Projection::Pinhole { focal, center }
            }
        };
        let (width, height) = (width.max(1), height.max(1));
        Camera { position: self.position, world_from_camera: self.rotation, projection, width, height }
    }
}

/// `[[proxy]]`: real geometry that is known.
#[derive(Clone, Debug, PartialEq)]
pub struct Proxy {
    /// Its form, in local space.
    pub shape: ProxyShape,
    /// Where it is in the world.
    pub placement: Placement,
    /// Diffuse reflectance, linear, [0, 1]; left out: estimated from the picture.
    pub albedo: Option<Vec3>,
}

/// `[[marker]]`: a printed marker that is to be found in the picture: the depth camera's, or else the panorama.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Marker {
    /// One of [`MARKER_FAMILIES`]. Default `tag36h11`.
    pub family: &'static str,
    /// Its number in the family; no two markers of a scene have the same.
    pub id: u32,
    /// Side of the black square in metres, positive.
    pub size: f32,
}

/// Families of AprilTags.
pub const MARKER_FAMILIES: [&str; 9] = [
    "tag36h11",
    "tag16h5",
    "tag25h9",
    "tag36h10",
    "tagcircle21h7",
    "tagcircle49h12",
    "tagcustom48h12",
    "tagstandard41h12",
    "tagstandard52h13",
];

/// The form of a proxy.
#[derive(Clone, Debug, PartialEq)]
pub enum ProxyShape {
    /// A rectangle in the local XZ plane, centred, facing +Y.
    Plane {
        /// Extent along local X and Z in metres, positive.
        size: Vec2,
    },
    /// A mesh file.
    Mesh(PathBuf),
}

/// `[[object]]`: a virtual object.
#[derive(Clone, Debug)]
pub struct Object {
    /// Its mesh file: PLY, OBJ, glTF or GLB.
    pub mesh: PathBuf,
    /// The [`Marker::id`] of the marker that its placement and keyframes are relative to: its origin is the marker's middle, +Y
    /// points out of the paper, −Z to the print's top. `None`: relative to the world.
    pub marker: Option<u32>,
    /// Where it is, unless keyframes say otherwise.
    pub placement: Placement,
    /// Replaces the mesh file's own materials. Keys left out take [`Material::default`]: base colour 0.8, metallic 0,
    /// roughness 1, specular 1, ior 1.5, transmission 0.
    pub material: Option<Material>,
    /// Motion, sorted by time; empty: none.
    pub keyframes: Vec<Keyframe>,
}

impl Object {
    /// Where the object is at `time` seconds; frame n of a sequence is at n / fps. Before the first and after the last keyframe
    /// it stands still.
    pub fn placement_at(&self, time: f32) -> Placement {
        placement::at(&self.keyframes, time).unwrap_or(self.placement)
    }
}

/// `[view]`: what the output shows.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct View {
    /// `kind`, with `vfov`. Default: the whole panorama.
    pub kind: ViewKind,
    /// Degrees to the right of −Z. Left out: 0; in a panorama view without `yaw` and `pitch`, as the input picture, so
    /// that its pixels need no resampling.
    pub yaw: Option<f32>,
    /// Degrees up, [−90, 90]. Left out: 0.
    pub pitch: Option<f32>,
    /// Width and height in pixels, [1, 32768]. Left out: 1024×768 in perspective, the input's size for a panorama.
    pub size: Option<(usize, usize)>,
    /// World position in metres. Left out: the capture point.
    pub position: Option<Vec3>,
}

/// The projection of a view.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum ViewKind {
    /// The whole 360° frame.
    #[default]
    Panorama,
    /// Rectilinear.
    Perspective {
        /// Vertical field of view in degrees, (0, 180). Default 60.
        vfov: f32,
    },
    /// What the depth camera sees, pixel for pixel; the default where there is a `[camera]`. No other key of `[view]` applies.
    Camera,
}

/// `[render]`: how to render.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Render {
    /// Default: [`Method::Auto`].
    pub method: Method,
    /// Samples a pixel, [1, 65536]. The error falls with the square root, the cost grows in proportion. Default 64.
    pub samples: u32,
    /// Scattering events after the camera, [1, 64]; 1 is direct light only. Of `rt2ar`: reflections and refractions that
    /// follow one another. Default: [`Method::default_bounces`].
    pub bounces: u32,
}

impl Render {
    /// Largest allowed value of `samples`.
    pub const MAX_SAMPLES: u32 = 65536;
    /// Largest allowed value of `bounces`.
    pub const MAX_BOUNCES: u32 = 64;
}

impl Default for Render {
    fn default() -> Self {
        Self { method: Method::Auto, samples: 64, bounces: Method::Auto.default_bounces() }
    }
}

impl Scene {
    /// Reads and checks a scene file.
    ///
    /// # Errors
    /// [`Error::File`] if it cannot be read, is no regular file, is larger than 16 MiB or is not UTF-8; [`Error::Scene`] if its content is at
    /// fault.
    pub fn load(path: impl AsRef<Path>) -> Result<Self> {
        let path = path.as_ref();
        let bytes = file::read(path, MAX_SCENE_BYTES)
            .map_err(|e| Error::file(path, format!("cannot be read: {e}"), "give a TOML scene file that can be read"))?;
        let text = String::from_utf8(bytes).map_err(|e| {
            let at = e.utf8_error().valid_up_to();
            Error::file(path, format!("byte {at} is not UTF-8 text"), "give a TOML scene file, saved as UTF-8")
        })?;
        Self::parse(&text, path)
    }

    /// Checks a scene file's text; `path` is where it came from (need not exist), paths in it are relative to its folder.
    ///
    /// # Errors
    /// [`Error::Scene`].
    pub fn parse(text: &str, path: impl AsRef<Path>) -> Result<Self> {
        parse::scene(text, path.as_ref())
    }

    /// The view's camera. `picture_size` is the size of the picture it is cut from, which a panorama view takes where it has
    /// none: the panorama's, or, for [`ViewKind::Camera`], the depth camera's.
    pub fn camera(&self, picture_size: (usize, usize)) -> Camera {
        if let (ViewKind::Camera, Some(camera)) = (self.view.kind, &self.camera) {
            return camera.camera(picture_size);
        }
        let view = &self.view;
        let turned = rotation_from_yaw_pitch(view.yaw.unwrap_or(0.0), view.pitch.unwrap_or(0.0));
        let (projection, world_from_camera, default_size) = match view.kind {
            ViewKind::Perspective { vfov } => (Projection::Perspective { vfov: vfov.to_radians() }, turned, (1024, 768)),
            ViewKind::Panorama | ViewKind::Camera if view.yaw.is_none() && view.pitch.is_none() => {
                (Projection::Panorama, self.panorama.world_from_pano(), picture_size)
            }
            ViewKind::Panorama | ViewKind::Camera => (Projection::Panorama, turned, picture_size),
        };
        let (width, height) = view.size.unwrap_or(default_size);
        Camera {
            position: view.position.unwrap_or(self.panorama.position),
            world_from_camera,
            projection,
            width: width.max(1),
            height: height.max(1),
        }
    }
}
