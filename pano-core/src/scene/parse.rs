//! From spanned TOML to a [`Scene`], table by table.

use super::{
    DepthCamera, FramePattern, Intrinsics, Keyframe, MARKER_FAMILIES, Marker, Method, Object, Panorama, PicturePath, Placement,
    Proxy, ProxyShape, Render, Rotation, Scene, View, ViewKind,
    paths::number_format,
    reader::{Source, Table, Value},
};
use crate::{
    Result,
    camera::rotation_from_yaw_pitch,
    depth::{DepthFormat, DepthKind},
    material::Material,
    sphere::Convention,
};
use glam::{Quat, Vec2, Vec3, Vec4};
use std::path::{Path, PathBuf};
use toml::de::DeTable;

/// Every table of the format and its keys; the document itself has the name "".
pub(super) const KEYS: &[(&str, &[&str])] = &[
    ("", &["panorama", "camera", "marker", "proxy", "object", "view", "render"]),
    ("panorama", &["color", "frames", "depth", "depth_format", "position", "heading", "convention", "camera_height", "fps"]),
    (
        "camera",
        &[
            "color",
            "depth",
            "depth_format",
            "vfov",
            "fx",
            "fy",
            "cx",
            "cy",
            "position",
            "yaw",
            "pitch",
            "roll",
            "rotation",
            "exposure",
        ],
    ),
    ("depth_format", &["kind", "scale", "invalid"]),
    ("proxy", &["plane", "mesh", "position", "yaw", "rotation", "scale", "albedo"]),
    ("plane", &["size"]),
    ("marker", &["family", "id", "size"]),
    ("object", &["mesh", "marker", "position", "yaw", "rotation", "scale", "material", "keyframes"]),
    ("keyframes", &["time", "position", "yaw", "rotation", "scale"]),
    (
        "material",
        &[
            "base_color",
            "metallic",
            "roughness",
            "specular",
            "specular_color",
            "ior",
            "transmission",
            "thin",
            "attenuation_color",
            "attenuation_distance",
            "emissive",
        ],
    ),
    ("view", &["kind", "yaw", "pitch", "vfov", "size", "position"]),
    ("render", &["method", "samples", "bounces"]),
];

/// Metres from the origin beyond which `f32` cannot place a surface to better than 6 cm.
const MAX_COORDINATE: f32 = 1e6;
/// Largest picture side, in pixels.
const MAX_SIDE: u32 = 32768;
/// Largest angle in degrees; more turns lose the fraction of a degree in `f32`.
const MAX_ANGLE: f32 = 36000.0;

/// Parses the whole file.
pub(super) fn scene(text: &str, path: &Path) -> Result<Scene> {
    let source = Source { path, text };
    let document = DeTable::parse(text).map_err(|e| {
        let remedy = "fix the TOML here; strings need quotes, tables a [header], e.g. color = \"room.exr\"";
        source.error(e.span().unwrap_or(0..0), e.message().replace('\n', ", "), remedy)
    })?;
    let root = Table::root(source, document.get_ref())?;
    let folder = path.parent().unwrap_or(Path::new(""));

    let camera = root.get("camera").map(|v| v.table("camera", "[camera]")).transpose()?;
    let panorama = match (root.get("panorama"), &camera) {
        (None, Some(camera)) => alone(camera, folder)?,
        _ => {
            let remedy = "add a [panorama] table with `color = \"room.exr\"`, or a [camera]";
            panorama(&root.require("panorama", remedy)?.table("panorama", "[panorama]")?, folder)?
        }
    };
    let camera = camera.map(|c| depth_camera(&c, folder, &panorama, root.get("panorama").is_none())).transpose()?;
    let tables = |key: &'static str, example| root.get(key).map_or(Ok(vec![]), |v| v.tables(key, example));
    let markers = markers(&tables("marker", "[[marker]]")?)?;
    Ok(Scene {
        path: path.to_owned(),
        proxies: tables("proxy", "[[proxy]]")?.iter().map(|t| proxy(t, folder)).collect::<Result<_>>()?,
        objects: tables("object", "[[object]]")?.iter().map(|t| object(t, folder, &markers)).collect::<Result<_>>()?,
        markers,
        view: match root.get("view") {
            Some(value) => view(&value.table("view", "[view]")?, camera.is_some())?,
            None if camera.is_some() => View { kind: ViewKind::Camera, ..View::default() },
            None => View::default(),
        },
        render: root.get("render").map_or(Ok(Render::default()), |v| render(&v.table("render", "[render]")?))?,
        panorama,
        camera,
    })
}

fn panorama(table: &Table<'_>, folder: &Path) -> Result<Panorama> {
    table.exclusive("color", "frames", "keep `color` for one picture or `frames` for a sequence")?;
    let color = match table.get("frames") {
        Some(value) => match numbered(&value, folder)? {
            PicturePath::Still(_) => {
                return Err(value.error("`frames` has no frame number", "write it like `frames = \"frame_%04d.exr\"`"));
            }
            pattern => pattern,
        },
        None => {
            let color = table.require("color", "add `color = \"room.exr\"`, or `frames = \"frame_%04d.exr\"`")?;
            PicturePath::Still(file(&color, folder)?)
        }
    };
    let depth = match table.get("depth") {
        Some(value) if color.is_sequence() => Some(numbered(&value, folder)?),
        Some(value) => {
            if number_format(value.string()?).is_some() {
                return Err(
                    value.error("`depth` is a sequence but `color` is one picture", "name one depth map, or use `frames`")
                );
            }
            Some(PicturePath::Still(file(&value, folder)?))
        }
        None => None,
    };
    let conventions = [
        ("forward", Convention::Forward),
        ("three", Convention::Three),
        ("blender", Convention::Blender),
        ("mitsuba", Convention::Mitsuba),
        ("usd", Convention::Usd),
    ];
    Ok(Panorama {
        color,
        depth,
        depth_format: table.get("depth_format").map_or(Ok(DepthFormat::default()), |v| depth_format(&v))?,
        position: table.get("position").map_or(Ok(Vec3::ZERO), |v| position(&v))?,
        heading: table.get("heading").map_or(Ok(0.0), |v| angle(&v))?,
        convention: table.get("convention").map_or(Ok(Convention::Forward), |v| v.choice(&conventions))?,
        camera_height: table
            .get("camera_height")
            .map(|v| v.number(|h| h > 0.0 && h <= MAX_COORDINATE, "of metres above 0, at most 1e6"))
            .transpose()?,
        fps: table.get("fps").map_or(Ok(30.0), |v| v.number(|f| f > 0.0 && f <= 1000.0, "above 0, at most 1000"))?,
    })
}

/// What takes the panorama's place where there is a camera only.
fn alone(camera: &Table<'_>, folder: &Path) -> Result<Panorama> {
    let color = camera.require("color", "add `color = \"color.png\"`")?;
    Ok(Panorama {
        color: numbered(&color, folder)?,
        depth: None,
        depth_format: DepthFormat::default(),
        position: camera.get("position").map_or(Ok(Vec3::ZERO), |v| position(&v))?,
        heading: 0.0,
        convention: Convention::Forward,
        camera_height: None,
        fps: 30.0,
    })
}

fn depth_camera(table: &Table<'_>, folder: &Path, panorama: &Panorama, alone: bool) -> Result<DepthCamera> {
    let color_value = table.require("color", "add `color = \"color.png\"`")?;
    let depth_value = table.require("depth", "add `depth = \"depth.png\"`")?;
    let (color, depth) = (numbered(&color_value, folder)?, numbered(&depth_value, folder)?);
    if color.is_sequence() && !panorama.color.is_sequence() {
        return Err(color_value.error(
            "`color` is a sequence but the panorama is one picture",
            "give the panorama `frames`, or leave [panorama] out",
        ));
    }
    if depth.is_sequence() && !color.is_sequence() {
        return Err(depth_value.error("`depth` is a sequence but `color` is one picture", "name one depth map"));
    }
    let z_in_metres = DepthFormat { kind: DepthKind::Z, ..DepthFormat::default() };
    for other in ["fx", "fy", "cx", "cy"] {
        table.exclusive("vfov", other, "keep `vfov`, or `fx`, `fy`, `cx` and `cy`")?;
    }
    let positive = |v: Value<'_>| v.number(|f| (1e-3..=1e6).contains(&f), "of pixels in [1e-3, 1e6]");
    let anywhere = |v: Value<'_>| v.number(|c| c.abs() <= 1e6, "of pixels in [-1e6, 1e6]");
    let focal = table.get("fx").map(positive).transpose()?;
    let intrinsics = match focal {
        Some(fx) => Intrinsics::Pixels {
            focal: Vec2::new(fx, table.get("fy").map_or(Ok(fx), positive)?),
            center: [table.get("cx").map(anywhere).transpose()?, table.get("cy").map(anywhere).transpose()?],
        },
        None => {
            if let Some(value) = ["fy", "cx", "cy"].into_iter().find_map(|key| table.get(key)) {
                return Err(value.error(format!("`{}` needs `fx`", value.key), "add `fx`, the focal length in pixels"));
            }
            let vfov = |v: Value<'_>| v.number(|d| d > 0.0 && d < 180.0, "of degrees between 0 and 180");
            Intrinsics::Vfov(table.get("vfov").map_or(Ok(45.0), vfov)?)
        }
    };
    for other in ["yaw", "pitch", "roll"] {
        table.exclusive(other, "rotation", "keep `yaw`, `pitch` and `roll`, or `rotation`")?;
    }
    let degrees = |key| table.get(key).map_or(Ok(0.0), |v: Value<'_>| angle(&v));
    let rotation = match table.get("rotation") {
        Some(value) => quaternion(&value)?,
        None => {
            let roll = Quat::from_rotation_z(-degrees("roll")?.to_radians());
            rotation_from_yaw_pitch(degrees("yaw")?, degrees("pitch")?) * roll
        }
    };
    Ok(DepthCamera {
        color,
        depth,
        depth_format: table.get("depth_format").map_or(Ok(z_in_metres), |v| depth_format(&v))?,
        intrinsics,
        position: table.get("position").map_or(Ok(panorama.position), |v| position(&v))?,
        rotation,
        exposure: table.get("exposure").map_or(Ok(1.0), |v| v.number(|e| (1e-6..=1e6).contains(&e), "in [1e-6, 1e6]"))?,
        alone,
    })
}

fn depth_format(value: &Value<'_>) -> Result<DepthFormat> {
    if value.is_string() {
        let presets = DepthFormat::PRESETS.map(|name| (name, name));
        let name = value.choice(&presets)?;
        return Ok(DepthFormat::preset(name).unwrap_or_default());
    }
    let example = "depth_format = \"exr\"` or `depth_format = { kind = \"ray\", scale = 1.0, invalid = 0.0 }";
    let table = value.table("depth_format", example)?;
    let kinds = [DepthKind::Ray, DepthKind::Z, DepthKind::Disparity].map(|kind| (kind.name(), kind));
    let invalid = |v: Value<'_>| v.number(|_| true, "; NaN and infinite depths always mean that nothing is there");
    Ok(DepthFormat {
        kind: table.get("kind").map_or(Ok(DepthKind::Ray), |v| v.choice(&kinds))?,
        scale: table.get("scale").map_or(Ok(1.0), |v| v.number(|s| (1e-9..=1e9).contains(&s), "in [1e-9, 1e9]"))?,
        invalid: table.get("invalid").map(invalid).transpose()?.into_iter().collect(),
    })
}

fn proxy(table: &Table<'_>, folder: &Path) -> Result<Proxy> {
    table.exclusive("plane", "mesh", "keep one of them; a second proxy gets its own [[proxy]]")?;
    let shape = match table.get("plane") {
        Some(plane) => {
            let example = "plane = { size = [6.0, 6.0] }";
            let size = plane.table("plane", example)?.require("size", &format!("write it like `{example}`"))?;
            let range = "of metres above 0, at most 1e6";
            ProxyShape::Plane { size: Vec2::from(size.numbers(|s| s > 0.0 && s <= MAX_COORDINATE, range, "[6.0, 6.0]")?) }
        }
        None => {
            let mesh = table.require("mesh", "add `plane = { size = [6.0, 6.0] }` or `mesh = \"room.glb\"`")?;
            ProxyShape::Mesh(file(&mesh, folder)?)
        }
    };
    let albedo = table.get("albedo").map(|v| v.color(1.0)).transpose()?;
    Ok(Proxy { shape, placement: placement(table, Placement::default())?, albedo })
}

fn markers(tables: &[Table<'_>]) -> Result<Vec<Marker>> {
    let families = MARKER_FAMILIES.map(|name| (name, name));
    let mut markers: Vec<Marker> = vec![];
    for table in tables {
        let value = table.require("id", "add `id = 0`, the number of the printed marker")?;
        let id = value.integer(0..=65535)?;
        if markers.iter().any(|marker| marker.id == id) {
            return Err(value.error(format!("two markers have the id {id}"), "give each marker its own"));
        }
        let size = table.require("size", "add `size = 0.1`, the side of the black square in metres")?;
        markers.push(Marker {
            family: table.get("family").map_or(Ok(MARKER_FAMILIES[0]), |v| v.choice(&families))?,
            id,
            size: size.number(|s| s > 0.0 && s <= 1000.0, "of metres above 0, at most 1000")?,
        });
    }
    Ok(markers)
}

fn object(table: &Table<'_>, folder: &Path, markers: &[Marker]) -> Result<Object> {
    let mesh = file(&table.require("mesh", "add `mesh = \"bunny.ply\"`")?, folder)?;
    let placement = placement(table, Placement::default())?;
    let material = table.get("material").map(|v| material(&v)).transpose()?;
    let keyframes = table.get("keyframes").map_or(Ok(vec![]), |v| keyframes(&v, placement))?;
    let marker = table.get("marker").map(|v| Ok((v.integer(0..=65535)?, v))).transpose()?;
    if let Some((id, value)) = marker.as_ref().filter(|(id, _)| !markers.iter().any(|marker| marker.id == *id)) {
        let remedy = format!("add a [[marker]] with `id = {id}` and its `size`");
        return Err(value.error(format!("there is no marker {id}"), remedy));
    }
    let marker = marker.map(|(id, _)| id);
    Ok(Object { mesh, marker, placement, material, keyframes })
}

fn keyframes(value: &Value<'_>, rest: Placement) -> Result<Vec<Keyframe>> {
    let example = "keyframes = [{ time = 0.0, position = [0.0, 0.0, 0.0] }]";
    let mut keyframes: Vec<Keyframe> = vec![];
    for table in value.tables("keyframes", example)? {
        let value = table.require("time", "add `time = 0.0`, in seconds")?;
        let time = value.number(|t| (0.0..=1e6).contains(&t), "of seconds in [0, 1e6]")?;
        if let Some(last) = keyframes.last().filter(|k| k.time >= time) {
            let problem = format!("keyframe at {time} s follows one at {} s", last.time);
            return Err(value.error(problem, "sort the keyframes by time and give each its own"));
        }
        keyframes.push(Keyframe { time, placement: placement(&table, rest)? });
    }
    Ok(keyframes)
}

fn material(value: &Value<'_>) -> Result<Material> {
    let table = value.table("material", "material = { base_color = [0.7, 0.7, 0.7], roughness = 1.0 }")?;
    let default = Material::default();
    let color = |key, max, default| table.get(key).map_or(Ok(default), |v: Value<'_>| v.color(max));
    let unit =
        |key, default| table.get(key).map_or(Ok(default), |v: Value<'_>| v.number(|x| (0.0..=1.0).contains(&x), "in [0, 1]"));
    Ok(Material {
        base_color: color("base_color", 1.0, default.base_color)?,
        metallic: unit("metallic", default.metallic)?,
        roughness: unit("roughness", default.roughness)?,
        specular: unit("specular", default.specular)?,
        specular_color: color("specular_color", 1.0, default.specular_color)?,
        ior: table.get("ior").map_or(Ok(default.ior), |v| v.number(|x| (1.0..=10.0).contains(&x), "in [1, 10]"))?,
        transmission: unit("transmission", default.transmission)?,
        thin: table.get("thin").map_or(Ok(default.thin), |v| v.boolean())?,
        attenuation_color: color("attenuation_color", 1.0, default.attenuation_color)?,
        attenuation_distance: table.get("attenuation_distance").map_or(Ok(default.attenuation_distance), |v| {
            v.number(|x| (1e-9..=1e9).contains(&x), "of metres in [1e-9, 1e9], or leave it out for a clear body")
        })?,
        emissive: color("emissive", 1e9, default.emissive)?,
        ..default
    })
}

fn view(table: &Table<'_>, has_camera: bool) -> Result<View> {
    let kinds =
        [("panorama", ViewKind::Panorama), ("perspective", ViewKind::Perspective { vfov: 60.0 }), ("camera", ViewKind::Camera)];
    let kind = table.get("kind").map(|v| Ok((v.choice(&kinds)?, v))).transpose()?;
    if let Some((ViewKind::Camera, value)) = &kind {
        if !has_camera {
            return Err(value.error("there is no [camera] to look through", "add a [camera], or choose another kind"));
        }
        if let Some(value) = ["yaw", "pitch", "vfov", "size", "position"].into_iter().find_map(|key| table.get(key)) {
            let problem = format!("the camera's own view has no `{}`", value.key);
            return Err(value.error(problem, "leave it out, or choose `kind = \"perspective\"`"));
        }
        return Ok(View { kind: ViewKind::Camera, ..View::default() });
    }
    let kind = if matches!(kind, Some((ViewKind::Perspective { .. }, _))) {
        let vfov = table.get("vfov").map_or(Ok(60.0), |v| v.number(|d| d > 0.0 && d < 180.0, "of degrees between 0 and 180"))?;
        ViewKind::Perspective { vfov }
    } else if let Some(vfov) = table.get("vfov") {
        return Err(vfov.error("a panorama view has no `vfov`", "add `kind = \"perspective\"`, or leave `vfov` out"));
    } else {
        ViewKind::Panorama
    };
    let size = table.get("size").map(|v| Ok((v.pixels(MAX_SIDE)?, v))).transpose()?;
    if let (ViewKind::Panorama, Some(((w, h), value))) = (kind, &size)
        && *w != 2 * h
    {
        let remedy = format!("give e.g. size = [{}, {h}], or add `kind = \"perspective\"`", 2 * h);
        return Err(value.error(format!("a panorama is twice as wide as high, not {w}×{h}"), remedy));
    }
    Ok(View {
        kind,
        yaw: table.get("yaw").map(|v| angle(&v)).transpose()?,
        pitch: table.get("pitch").map(|v| v.number(|d| (-90.0..=90.0).contains(&d), "of degrees in [-90, 90]")).transpose()?,
        size: size.map(|(size, _)| size),
        position: table.get("position").map(|v| position(&v)).transpose()?,
    })
}

fn render(table: &Table<'_>) -> Result<Render> {
    let default = Render::default();
    let methods = Method::ALL.map(|m| (m.name(), m));
    let method = table.get("method").map_or(Ok(default.method), |v| v.choice(&methods))?;
    Ok(Render {
        method,
        samples: table.get("samples").map_or(Ok(default.samples), |v| v.integer(1..=Render::MAX_SAMPLES))?,
        bounces: table.get("bounces").map_or(Ok(method.default_bounces()), |v| v.integer(1..=Render::MAX_BOUNCES))?,
    })
}

/// `position`, `yaw` or `rotation`, and `scale`; what is missing is taken from `default`.
fn placement(table: &Table<'_>, default: Placement) -> Result<Placement> {
    table.exclusive("yaw", "rotation", "keep one of them")?;
    let rotation = match (table.get("yaw"), table.get("rotation")) {
        (Some(yaw), _) => Rotation::Yaw(angle(&yaw)?),
        (None, Some(value)) => Rotation::Quaternion(quaternion(&value)?),
        (None, None) => default.rotation,
    };
    let scale = |v: Value<'_>| v.number(|s| (1e-6..=1e6).contains(&s), "in [1e-6, 1e6]");
    Ok(Placement {
        position: table.get("position").map_or(Ok(default.position), |v| position(&v))?,
        rotation,
        scale: table.get("scale").map_or(Ok(default.scale), scale)?,
    })
}

fn quaternion(value: &Value<'_>) -> Result<Quat> {
    let q = Vec4::from(value.numbers(|x| x.abs() <= 1e6, "in [-1e6, 1e6]", "[0.0, 0.0, 0.0, 1.0]")?);
    if q.length() < 1e-6 {
        return Err(value.error(
            "`rotation` is zero, which is no rotation",
            "give a unit quaternion [x, y, z, w]; [0, 0, 0, 1] does not rotate",
        ));
    }
    Ok(Quat::from_vec4(q.normalize()))
}

fn position(value: &Value<'_>) -> Result<Vec3> {
    value.numbers(|x| x.abs() <= MAX_COORDINATE, "of metres in [-1e6, 1e6]", "[0.0, 0.0, 0.0]").map(Vec3::from_array)
}

fn angle(value: &Value<'_>) -> Result<f32> {
    value.number(|d| d.abs() <= MAX_ANGLE, "of degrees in [-36000, 36000]")
}

/// A path, relative to the scene file's folder.
fn file(value: &Value<'_>, folder: &Path) -> Result<PathBuf> {
    let path = value.string()?;
    if path.contains('\0') {
        return Err(value.error(format!("`{}` holds a NUL character", value.key), "give a file name"));
    }
    Ok(folder.join(path))
}

/// A path that may hold a frame number in its file name.
fn numbered(value: &Value<'_>, folder: &Path) -> Result<PicturePath> {
    let path = file(value, Path::new(""))?;
    if number_format(value.string()?).is_none() {
        return Ok(PicturePath::Still(folder.join(path)));
    }
    match FramePattern::new(&path) {
        Some(pattern) => Ok(PicturePath::Frames(pattern.inside(folder))),
        None => Err(value.error(
            format!("`{}` may hold one frame number, in the file name", value.key),
            "write it like `frames/frame_%04d.exr`",
        )),
    }
}
