//! Small scenes in which things go wrong, for every method and backend: what each is, and what must come of it.

use crate::rooms::{Cuboid, Room};
use glam::Vec3;
use pano_compose::pipeline::{Backend, RenderOptions, Rendered, render};
use pano_core::image::{Image, RadianceImage};
use pano_core::progress::Silent;
use pano_core::scene::{Method, Scene};
use pano_core::{Result, io};
use std::path::Path;
use tempfile::TempDir;

/// Every method.
pub const METHODS: [Method; 7] =
    [Method::Iprt, Method::Dpt, Method::Mr360, Method::Rt2ar, Method::Ibl, Method::Onepass, Method::Twopass];

/// What must come of a scene, besides finite layers that add up.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Outcome {
    /// Nothing more.
    Finite,
    /// The photo, bit for bit.
    Untouched,
    /// The photo, but for this share of its light.
    Nearly(f64),
    /// Objects cover every pixel.
    Covered,
    /// Objects are seen, real surfaces do not change: there are none.
    OnlyObjects,
    /// Objects are seen, and where they are not the picture differs from the photo somewhere (of the methods that change
    /// anything).
    Seen,
}

/// A scene and what must come of it.
#[derive(Clone, Debug)]
pub struct Nasty {
    /// What is nasty about it.
    pub name: &'static str,
    /// The panorama.
    pub picture: RadianceImage,
    /// Its depth; `None` for a ground at `camera_height`.
    pub depth: Option<Image<f32>>,
    /// The `[[object]]` tables and `[view]`, over the meshes of [`Nasty::write`].
    pub text: String,
    /// What must come of it.
    pub outcome: Outcome,
}

/// A closed room of 4×3×4 m, the capture point in the middle.
fn room() -> Room {
    Room {
        walls: Cuboid { lo: Vec3::new(-2.0, -1.5, -2.0), hi: Vec3::new(2.0, 1.5, 2.0) },
        table: None,
        window: None,
        colors: [Vec3::new(0.5, 0.4, 0.3), Vec3::new(0.3, 0.5, 0.7)],
        lights: [Vec3::ONE, Vec3::splat(8.0)],
    }
}

const VIEW: &str = "[view]\nkind = 'perspective'\npitch = -35\nvfov = 70\nsize = [14, 10]\n";

/// An object of that mesh, with these keys.
fn object(mesh: &str, keys: &str) -> String {
    format!("[[object]]\nmesh = '{mesh}.ply'\n{keys}\n")
}

/// A matt cube on the floor before the camera.
fn cube() -> String {
    object("cube", "position = [0, -1.25, -1.2]\nscale = 0.5\nmaterial = { specular = 0 }")
}

impl Nasty {
    fn new(name: &'static str, outcome: Outcome) -> Self {
        let (picture, depth) = (room().radiance(32), Some(room().depth(32)));
        Self { name, picture, depth, text: cube() + VIEW, outcome }
    }

    fn objects(name: &'static str, outcome: Outcome, objects: &str) -> Self {
        Self { text: objects.to_owned() + VIEW, ..Self::new(name, outcome) }
    }

    fn picture(name: &'static str, outcome: Outcome, picture: impl Fn(usize, usize) -> Vec3) -> Self {
        Self { picture: Image::from_fn(32, 16, picture), ..Self::new(name, outcome) }
    }

    fn depth(name: &'static str, outcome: Outcome, depth: impl Fn(usize, usize) -> f32) -> Self {
        Self { depth: Some(Image::from_fn(32, 16, depth)), ..Self::new(name, outcome) }
    }

    /// Seen with 128×64 texels: fewer leave gaps in the corners of the room.
    fn closed(name: &'static str, outcome: Outcome, objects: &str) -> Self {
        let (picture, depth) = (room().radiance(128), Some(room().depth(128)));
        Self { picture, depth, ..Self::objects(name, outcome, objects) }
    }

    fn size(name: &'static str, width: usize, height: usize) -> Self {
        let picture = Image::from_fn(width, height, |x, y| Vec3::new(1.0, 0.5, 0.25) * (1 + (x + y) % 3) as f32);
        Self { picture, depth: Some(Image::filled(width, height, 2.0)), ..Self::new(name, Outcome::Finite) }
    }

    /// Writes the scene's files into `folder`: pictures and the meshes `cube` (unit), `ball` (unit radius), `square` (unit, facing
    /// up), `flat` (degenerate faces only), `twice` (every face of the cube twice).
    ///
    /// # Errors
    /// Faults of the file system.
    ///
    /// # Panics
    /// If the scene's text is not valid.
    pub fn write(&self, folder: &Path, method: Method) -> Result<Scene> {
        use pano_core::builtin::primitives;
        io::write_image(folder.join("room.exr"), &self.picture, None)?;
        let mut panorama = "[panorama]\ncolor = 'room.exr'\n".to_owned();
        match &self.depth {
            Some(depth) => {
                io::write_exr(folder.join("depth.exr"), &[("Z", depth)], &[])?;
                panorama += "depth = 'depth.exr'\n";
            }
            None => panorama += "camera_height = 1.5\n",
        }
        let cube = primitives::cuboid(Vec3::ONE);
        let mut twice = cube.triangles.clone();
        twice.extend_from_slice(&cube.triangles);
        let ball = primitives::icosphere(1.0, 3);
        let square = [Vec3::new(-0.5, 0.0, -0.5), Vec3::new(-0.5, 0.0, 0.5), Vec3::new(0.5, 0.0, 0.5), Vec3::new(0.5, 0.0, -0.5)];
        let meshes: [Faces<'_>; 5] = [
            ("cube", &cube.positions, &cube.triangles),
            ("twice", &cube.positions, &twice),
            ("ball", &ball.positions, &ball.triangles),
            ("square", &square, &[[0, 1, 2], [0, 2, 3]]),
            ("flat", &square, &[[0, 0, 1], [1, 2, 1], [3, 3, 3]]),
        ];
        for (name, positions, triangles) in meshes {
            io::write_text(folder.join(format!("{name}.ply")), &ply(positions, triangles))?;
        }
        let render = format!("[render]\nmethod = '{}'\nsamples = 4\nbounces = 3\n", method.name());
        Ok(Scene::parse(&format!("{panorama}{}{render}", self.text), folder.join("scene.toml")).expect(self.name))
    }

    /// Whether the method takes such a scene: `iprt` needs depth.
    pub fn suits(&self, method: Method) -> bool {
        method != Method::Iprt || self.depth.is_some()
    }

    /// Renders it by `method`.
    ///
    /// # Panics
    /// If it cannot be rendered.
    pub fn render(&self, method: Method, backend: Backend) -> Rendered {
        let folder = TempDir::new().expect("a folder for temporary files");
        let scene = self.write(folder.path(), method).expect("the files can be written");
        let mut options = RenderOptions { backend, ..RenderOptions::default() };
        (options.settings.captured.irradiance_width, options.settings.captured.irradiance_samples) = (32, 2);
        render(&scene, &options, &Silent).unwrap_or_else(|e| panic!("{}, {method:?}: {e}", self.name))
    }

    /// Checks what came of it.
    ///
    /// # Panics
    /// If that is not what must.
    pub fn check(&self, method: Method, rendered: &Rendered) {
        let what = format!("{}, {method:?}", self.name);
        let Rendered { layers, photo, composite, .. } = rendered;
        let colors = [&composite.color, &composite.multiplier, &layers.object, &layers.delta, &layers.normal, &layers.albedo];
        for (i, image) in colors.into_iter().enumerate() {
            let bad = image.data().iter().position(|p| !p.is_finite());
            assert!(bad.is_none(), "{what}: layer {i} is {} at {bad:?}", image.data()[bad.unwrap_or(0)]);
        }
        assert!(composite.color.data().iter().all(|p| p.min_element() >= 0.0), "{what}: negative light");
        assert!(layers.coverage.data().iter().all(|a| (0.0..=1.0).contains(a)), "{what}: coverage");
        assert!(layers.depth.data().iter().all(|d| *d > 0.0), "{what}: depth");
        let irradiance = rendered.irradiance.iter().flat_map(|i| i.real.data().iter().copied().chain(i.mixed().data().to_vec()));
        irradiance.for_each(|e| assert!(e.is_finite(), "{what}: irradiance {e}"));
        rendered.shadows.iter().flat_map(|s| s.data()).for_each(|s| assert!((0.0..=1.001).contains(s), "{what}: shadow {s}"));
        assert!(
            !rendered.stats.warnings.iter().any(|w| w.contains("not finite and count")),
            "{what}: {:?}",
            rendered.stats.warnings
        );
        let pixels = || photo.data().iter().zip(composite.color.data()).zip(layers.coverage.data());
        let covered = || layers.coverage.data().iter().filter(|a| **a > 0.0).count();
        match self.outcome {
            Outcome::Finite => {}
            // Two independent solutions differ by noise everywhere: that is what makes it the baseline to compare with.
            Outcome::Untouched | Outcome::Nearly(_)
                if method == Method::Twopass && rendered.stats.stages.iter().any(|s| s.rays > 0) => {}
            Outcome::Untouched => {
                let changed = pixels().position(|((photo, out), _)| photo != out);
                assert!(changed.is_none(), "{what}: pixel {changed:?} has changed");
            }
            Outcome::Nearly(share) => {
                let difference: f64 = pixels().map(|((photo, out), _)| f64::from((*photo - *out).abs().element_sum())).sum();
                let all: f64 = photo.data().iter().map(|p| f64::from(p.element_sum())).sum();
                assert!(difference <= share * all, "{what}: {} of the light", difference / all);
            }
            Outcome::Covered => assert!(layers.coverage.data().iter().all(|a| *a == 1.0), "{what}: {:?}", layers.coverage),
            Outcome::OnlyObjects => {
                assert!(covered() > 0, "{what}: no object is seen");
                let change = layers.delta.data().iter().position(|d| *d != Vec3::ZERO);
                assert!(change.is_none(), "{what}: something real has changed at {change:?}");
            }
            Outcome::Seen => {
                assert!(covered() > 0, "{what}: no object is seen");
                let changes = pixels().any(|((photo, out), coverage)| *coverage == 0.0 && photo != out);
                // rt2ar adds the shadows of lights only: under the ceiling's lamp the cube hides its own.
                let changes_nothing = matches!(method, Method::Ibl | Method::Rt2ar);
                assert!(changes || changes_nothing, "{what}: nothing real changes");
            }
        }
    }
}

/// A mesh's name, vertices and faces.
type Faces<'a> = (&'a str, &'a [Vec3], &'a [[u32; 3]]);

/// An ASCII PLY.
fn ply(positions: &[Vec3], triangles: &[[u32; 3]]) -> String {
    let mut text = format!(
        "ply\nformat ascii 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\nelement face {}\n\
         property list uchar uint vertex_indices\nend_header\n",
        positions.len(),
        triangles.len()
    );
    positions.iter().for_each(|p| text += &format!("{} {} {}\n", p.x, p.y, p.z));
    triangles.iter().for_each(|[a, b, c]| text += &format!("3 {a} {b} {c}\n"));
    text
}

/// The scenes.
pub fn scenes() -> Vec<Nasty> {
    use Outcome::{Covered, Finite, Nearly, OnlyObjects, Seen, Untouched};
    let around = |material: &str| object("ball", &format!("scale = 0.5\nmaterial = {material}"));
    let plain = room().radiance(32);
    let value = |x: usize, y: usize| plain.get(x, y);
    let nasty_depths = [0.0, -1.0, f32::NAN, f32::INFINITY, 1e-6, 1e9, 1e8, 2.0, 0.01];
    let ball = |material: &str| object("ball", &format!("position = [0, -1.1, -1.2]\nscale = 0.4\nmaterial = {material}"));
    let glass = "{ transmission = 1, roughness = 0, ior = 1.5 }";
    let panorama_view = |mut nasty: Nasty| {
        nasty.text = nasty.text.replace(VIEW, "");
        nasty
    };
    vec![
        Nasty::new("a cube in a room", Seen),
        Nasty { depth: None, ..Nasty::new("a cube on a ground without depth", Seen) },
        panorama_view(Nasty::new("the whole panorama", Seen)),
        Nasty {
            text: cube() + "[view]\nkind = 'perspective'\nsize = [1, 1]\npitch = -90\n",
            ..Nasty::new("a view of one pixel", Finite)
        },
        Nasty {
            text: cube() + "[view]\nkind = 'perspective'\nsize = [9, 7]\nvfov = 179\npitch = 90\n",
            ..Nasty::new("179 degrees", Finite)
        },
        Nasty::size("a panorama of 2×1", 2, 1),
        Nasty::size("a panorama of 6×3", 6, 3),
        panorama_view(Nasty::size("a panorama of 2×1, whole", 2, 1)),
        panorama_view(Nasty::size("a panorama of 6×3, whole", 6, 3)),
        Nasty { depth: None, ..Nasty::size("a panorama of 2×1 without depth", 2, 1) },
        Nasty::picture("a black panorama", Finite, |_, _| Vec3::ZERO),
        Nasty::picture("a constant panorama", Finite, |_, _| Vec3::splat(0.5)),
        Nasty::picture("a sun of 1e5 in one pixel", Seen, |x, y| if (x, y) == (5, 4) { Vec3::splat(1e5) } else { value(x, y) }),
        Nasty {
            depth: None,
            ..Nasty::picture("a sun over a ground", Seen, |x, y| if (x, y) == (5, 4) { Vec3::splat(1e5) } else { value(x, y) })
        },
        Nasty::picture("light beyond half precision", Finite, |x, y| 1e6 * value(x, y)),
        Nasty::picture("light of 1e15", Finite, |x, y| 1e15 * value(x, y)),
        Nasty::picture("light of 1e-30", Finite, |x, y| 1e-30 * value(x, y)),
        Nasty::picture("one colour channel only", Seen, |x, y| value(x, y) * Vec3::X),
        Nasty::depth("depth of 0", OnlyObjects, |_, _| 0.0),
        Nasty::depth("depth of NaN", OnlyObjects, |_, _| f32::NAN),
        Nasty::depth("infinite depth", OnlyObjects, |_, _| f32::INFINITY),
        Nasty::depth("depth of 1e9", OnlyObjects, |_, _| 1e9),
        Nasty::depth("depth of 1e8", Finite, |_, _| 1e8),
        Nasty::depth("depth of 1e-6", Untouched, |_, _| 1e-6),
        Nasty::depth("depth of all kinds side by side", Finite, |x, y| nasty_depths[(3 * x + 5 * y) % 9]),
        Nasty::objects("no object", Untouched, ""),
        Nasty::objects("degenerate faces only", Untouched, &object("flat", "position = [0, -1, -1]")),
        Nasty::closed("an object behind the wall", Untouched, &object("cube", "position = [0, -1, -4]")),
        // One ray in some hundred finds a way out through the corners of the captured room.
        Nasty::closed("an object larger than the room, around it", Nearly(0.02), &object("ball", "scale = 1000")),
        Nasty::objects("an object of 0.1 mm", Nearly(1e-3), &object("cube", "position = [0, -1, -1.2]\nscale = 1e-4")),
        Nasty::objects("a matt object around the camera", Covered, &around("{ specular = 0 }")),
        Nasty::objects("a mirror around the camera", Covered, &around("{ metallic = 1, roughness = 0 }")),
        Nasty::objects("glass around the camera", Covered, &around(glass)),
        Nasty::objects(
            "an object in the floor",
            Seen,
            &object("cube", "position = [0.1, -1.5, -1.2]\nrotation = [0.3, 0.1, 0, 1]"),
        ),
        Nasty::objects("a sheet in the floor's plane", Finite, &object("square", "position = [0, -1.5, -1.2]")),
        Nasty::objects(
            "every face twice",
            Seen,
            &object("twice", "position = [0, -1.25, -1.2]\nscale = 0.5\nmaterial = { specular = 0 }"),
        ),
        Nasty::objects("the same object twice", Seen, &cube().repeat(2)),
        Nasty::objects("glass in the same glass twice", Seen, &ball(glass).repeat(2)),
        Nasty::objects("a mirror", Seen, &ball("{ metallic = 1, roughness = 0 }")),
        Nasty::objects("a nearly perfect mirror", Seen, &ball("{ metallic = 1, roughness = 1e-4 }")),
        Nasty::objects("roughness 1, clear coat of index 4", Seen, &ball("{ roughness = 1, ior = 4 }")),
        Nasty::objects("glass of index 1", Finite, &ball("{ transmission = 1, roughness = 0, ior = 1 }")),
        Nasty::objects("rough glass of index 3", Seen, &ball("{ transmission = 1, roughness = 1, ior = 3 }")),
        Nasty::objects("a thin shell", Seen, &ball("{ transmission = 0.5, thin = true }")),
        Nasty::objects("a lamp of 1e6", Seen, &ball("{ emissive = [1e6, 1e6, 1e6] }")),
        Nasty::objects("a black object", Seen, &ball("{ base_color = [0, 0, 0], specular = 0 }")),
    ]
}

/// A room's picture with a sun, to be written and read back.
pub fn beyond_half_precision() -> Nasty {
    let plain = room().radiance(32);
    let sun = |x, y| if (x, y) == (5, 4) { Vec3::splat(1e6) } else { plain.get(x, y) };
    let nasty = Nasty::picture("a sun beyond half precision", Outcome::Seen, sun);
    Nasty { text: nasty.text.replace(VIEW, ""), ..nasty }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_unique() {
        let mut names: Vec<&str> = scenes().iter().map(|s| s.name).collect();
        names.sort_unstable();
        assert!(names.windows(2).all(|pair| pair[0] != pair[1]), "{names:?}");
    }

    #[test]
    #[should_panic(expected = "has changed")]
    fn a_change_where_none_may_be_is_found() {
        let scene = Nasty::new("a cube in a room", Outcome::Untouched);
        scene.check(Method::Dpt, &scene.render(Method::Dpt, Backend::Cpu));
    }
}
