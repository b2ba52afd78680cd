//! Files of every kind, written, read back and compared; damaged files; random damage.

use super::*;
use crate::material::Wrap;
use proptest::prelude::*;
use std::path::{Path, PathBuf};

/// A temporary folder for files.
struct Folder(tempfile::TempDir);

impl Folder {
    fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    fn file(&self, name: &str, bytes: impl AsRef<[u8]>) -> PathBuf {
        let path = self.0.path().join(name);
        std::fs::write(&path, bytes).unwrap();
        path
    }

    fn read(&self, name: &str, bytes: impl AsRef<[u8]>) -> Result<Mesh> {
        read_mesh(&self.file(name, bytes))
    }
}

fn png(pixels: &[[u8; 3]], width: u32) -> Vec<u8> {
    let mut bytes = std::io::Cursor::new(Vec::new());
    let picture = ::image::RgbImage::from_raw(width, pixels.len() as u32 / width, pixels.concat()).unwrap();
    picture.write_to(&mut bytes, ::image::ImageFormat::Png).unwrap();
    bytes.into_inner()
}

const ASCII_PLY: &str = "ply\nformat ascii 1.0\ncomment a square and a fifth vertex\nelement vertex 5\nproperty float x\nproperty double y\n\
    property float z\nproperty uchar red\nproperty float s\nproperty float t\nelement face 2\nproperty list uchar int vertex_indices\n\
    property uchar flags\nelement edge 1\nproperty int vertex1\nend_header\n\
    0 0 0 255 0 0\n0 0 1 255 0 1\n1 0 1 0 1 1\n1 0 0 0 1 0\n0.5 1 0.5 0 0.5 0.5\n4 0 1 2 3 7\n3 0 1 4 0\n1\n";

/// A binary PLY of one upright triangle with normals that are not unit length.
fn binary_ply(big: bool) -> Vec<u8> {
    let mut bytes = format!(
        "ply\nformat binary_{}_endian 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\nproperty float nx\n\
         property float ny\nproperty float nz\nelement face 1\nproperty list uchar uint vertex_index\nend_header\n",
        if big { "big" } else { "little" }
    )
    .into_bytes();
    let mut number = |b: [u8; 4]| bytes.extend(if big { b.into_iter().rev().collect::<Vec<_>>() } else { b.to_vec() });
    for v in [[0.0f32, 0.0, 0.0, 0.0, 0.0, 2.0], [1.0, 0.0, 0.0, 0.0, 0.0, 1.0], [0.0, 1.0, 0.0, 0.0, 0.0, 0.0]] {
        v.into_iter().for_each(|x| number(x.to_le_bytes()));
    }
    bytes.push(3);
    let mut number = |b: [u8; 4]| bytes.extend(if big { b.into_iter().rev().collect::<Vec<_>>() } else { b.to_vec() });
    [0u32, 1, 2].into_iter().for_each(|i| number(i.to_le_bytes()));
    bytes
}

#[test]
fn ascii_ply_with_polygons_and_other_properties() {
    let mesh = Folder::new().read("a.ply", ASCII_PLY).unwrap();
    assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3], [0, 1, 4]]);
    assert_eq!(mesh.positions[2], Vec3::new(1.0, 0.0, 1.0));
    assert_eq!(mesh.uvs[..2], [Vec2::new(0.0, 1.0), Vec2::new(0.0, 0.0)], "v is turned round");
    assert!(mesh.normals.is_empty() && mesh.materials.is_empty());
}

#[test]
fn binary_ply_of_both_byte_orders_with_normals_repaired() {
    for big in [false, true] {
        let mesh = Folder::new().read("a.ply", binary_ply(big)).unwrap();
        assert_eq!(mesh.positions, [Vec3::ZERO, Vec3::X, Vec3::Y]);
        assert_eq!(mesh.triangles, [[0, 1, 2]]);
        assert_eq!(mesh.normals, [Vec3::Z; 3]);
    }
}

#[test]
fn obj_with_polygons_relative_indices_and_shared_vertices() {
    let text = "# a square\no thing\nv 0 0 0\nv 0 0 1 0.5 0.5 0.5\nv 1 0 1\nv 1 0 0\nvt 0 0\nvt 0 1\nvt 1 1\nvt 1 0\nvn 0 2 0\n\
        f -4/-4/-1 2/2/1 \\\n3/3/1 4/4/1\nl 1 2\np 1\n";
    let mesh = Folder::new().read("a.obj", text).unwrap();
    assert_eq!(mesh.positions, [Vec3::ZERO, Vec3::Z, Vec3::new(1.0, 0.0, 1.0), Vec3::X]);
    assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3]]);
    assert_eq!(mesh.uvs, [Vec2::Y, Vec2::ZERO, Vec2::X, Vec2::ONE]);
    assert_eq!(mesh.normals, [Vec3::Y; 4]);
}

#[test]
fn obj_smoothing_groups_make_normals_and_flat_faces_stay_flat() {
    let roof = "v -1 0 0\nv -1 0 1\nv 0 1 0\nv 0 1 1\nv 1 0 0\nv 1 0 1\n";
    let faces = "f 1 2 4 3\nf 3 4 6 5\n";
    let folder = Folder::new();
    let smooth = folder.read("a.obj", format!("{roof}s 1\n{faces}")).unwrap();
    assert_eq!(smooth.positions.len(), 6);
    let ridge = smooth.positions.iter().position(|&p| p == Vec3::Y).unwrap();
    assert!(smooth.normals[ridge].distance(Vec3::Y) < 1e-6);
    let flat = folder.read("a.obj", format!("{roof}{faces}")).unwrap();
    assert!(flat.normals.is_empty() && flat.positions.len() == 6);
    let mixed = folder.read("a.obj", format!("{roof}s 1\nf 1 2 4 3\ns off\nf 3 4 6 5\n")).unwrap();
    assert_eq!(mixed.positions.len(), 8);
    assert!(mixed.normals.iter().all(|n| (n.y - 0.5f32.sqrt()).abs() < 1e-6));
}

#[test]
fn mtl_materials_with_textures() {
    let folder = Folder::new();
    folder.file("my kd.png", png(&[[188, 0, 255], [0, 255, 0]], 2));
    folder.file("rough.png", png(&[[128, 128, 128]], 1));
    folder.file(
        "a.mtl",
        "newmtl wood\nKd 0.5 0.5 0.5\nKs 0.25 0.25 0.25\nNs 30\nmap_Kd -s 2 3 1 -clamp on my kd.png\nnewmtl lamp\nKd 0 0 0\nKe 3 2 1\n\
         newmtl glass\nKd 0 0 0\nd 0.1\nNi 1.4\nillum 7\nnewmtl pbr\nKd 1 0 0\nPr 0.5\nPm 1\nmap_Pr rough.png\n\
         newmtl mirror\nKd 0 0 0\nKs 0.9 0.8 0.7\nNs 1000000\nillum 3\nnewmtl pane\nTr 0.75\nnewmtl short\nKd 0.25\n",
    );
    let names = ["wood", "lamp", "glass", "pbr", "mirror", "pane", "short"];
    let faces: String = names.iter().map(|n| format!("usemtl {n}\nf 1 2 3\n")).collect();
    let mesh = folder.read("a.obj", format!("mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n{faces}")).unwrap();
    assert_eq!(mesh.material_ids, [7, 0, 1, 2, 3, 4, 5, 6], "the face before `usemtl` has the default material");
    let [wood, lamp, glass, pbr, mirror, pane, short, _] = &mesh.materials[..] else { panic!("{}", mesh.materials.len()) };
    assert_eq!((wood.base_color, wood.specular), (Vec3::splat(0.5), 0.5));
    assert!((wood.roughness.powi(4) - 2.0 / 32.0).abs() < 1e-6);
    let map = wood.base_color_texture.as_ref().unwrap();
    assert_eq!((map.wrap_u, map.image().size()), (Wrap::Clamp, (2, 1)));
    assert!((map.image().get(0, 0).x - 0.5029).abs() < 1e-3, "sRGB 188 is half the light");
    // In OBJ's own terms v_up · 3, here through v = 1 − v_up.
    let v = |v_up: f32| 1.0 - map.texture_from_mesh.transform_point2(Vec2::new(0.0, 1.0 - v_up)).y;
    assert!((v(0.2) - 0.6).abs() < 1e-6);
    assert_eq!(lamp.emissive, Vec3::new(3.0, 2.0, 1.0));
    assert_eq!((glass.base_color, glass.ior, glass.thin), (Vec3::ONE, 1.4, false));
    assert!((glass.transmission - 0.9).abs() < 1e-6);
    assert_eq!((pbr.roughness, pbr.metallic), (0.5, 1.0));
    let map = pbr.metallic_roughness_texture.as_ref().unwrap().image().get(0, 0);
    assert!((map.y - 128.0 / 255.0).abs() < 1e-6 && map.z == 1.0);
    assert_eq!((mirror.metallic, mirror.base_color), (1.0, Vec3::new(0.9, 0.8, 0.7)));
    assert!(mirror.roughness < 0.05);
    assert!(pane.thin && (pane.transmission - 0.75).abs() < 1e-6);
    assert_eq!(short.base_color, Vec3::splat(0.25));
}

/// glTF JSON with one triangle mesh, `extra` merged in as further top-level members.
fn gltf_json(buffer: &str, nodes: &str, material: &str, extra: &str) -> String {
    format!(
        r#"{{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"nodes":[0]}}],"nodes":{nodes},
        "meshes":[{{"primitives":[{{"attributes":{{"POSITION":0,"TEXCOORD_0":2}},"indices":1,"material":0}}]}}],
        "materials":[{material}],
        "accessors":[{{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[1,1,0]}},
          {{"bufferView":1,"componentType":5123,"count":3,"type":"SCALAR"}},
          {{"bufferView":2,"componentType":5121,"normalized":true,"count":3,"type":"VEC2"}}],
        "bufferViews":[{{"buffer":0,"byteLength":36}},{{"buffer":0,"byteOffset":36,"byteLength":6}},
          {{"buffer":0,"byteOffset":44,"byteLength":12,"byteStride":4}}],
        "buffers":[{{"byteLength":56{buffer}}}]{extra}}}"#
    )
}

/// Positions 0, X, Y; indices 0 1 2; uvs of bytes.
fn gltf_bin() -> Vec<u8> {
    let mut bytes: Vec<u8> = [0.0f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0].iter().flat_map(|x| x.to_le_bytes()).collect();
    bytes.extend([0u16, 1, 2, 0].iter().flat_map(|x| x.to_le_bytes()));
    bytes.extend([0u8, 0, 0, 0, 255, 0, 0, 0, 0, 255, 0, 0]);
    bytes
}

fn glb(json: &str, bin: &[u8]) -> Vec<u8> {
    let mut json = json.as_bytes().to_vec();
    json.resize(json.len().next_multiple_of(4), b' ');
    let mut out = b"glTF\x02\0\0\0".to_vec();
    out.extend((28 + json.len() as u32 + bin.len() as u32).to_le_bytes());
    for (kind, chunk) in [(b"JSON", &json[..]), (b"BIN\0", bin)] {
        out.extend((chunk.len() as u32).to_le_bytes());
        out.extend(kind);
        out.extend(chunk);
    }
    out
}

const MATERIAL: &str = r#"{"pbrMetallicRoughness":{"baseColorFactor":[0.5,1,0.25,1],"metallicFactor":0.5,"roughnessFactor":0.25,
    "baseColorTexture":{"index":0,"extensions":{"KHR_texture_transform":{"offset":[0.5,0],"rotation":1.5707963,"scale":[2,1]}}}},
    "emissiveFactor":[1,0.5,0],"extensions":{"KHR_materials_ior":{"ior":1.25},"KHR_materials_emissive_strength":{"emissiveStrength":8},
    "KHR_materials_transmission":{"transmissionFactor":0.5},"KHR_materials_specular":{"specularFactor":0.75},
    "KHR_materials_volume":{"thicknessFactor":1,"attenuationDistance":2,"attenuationColor":[0.5,0.5,1]}}}"#;

#[test]
fn gltf_hierarchy_mirrors_and_materials() {
    let folder = Folder::new();
    folder.file("b in.bin", gltf_bin());
    folder.file("t.png", png(&[[255, 0, 0], [0, 0, 255]], 2));
    let nodes = r#"[{"children":[1],"translation":[1,2,3]},{"mesh":0,"scale":[-2,1,1]}]"#;
    let extra = r#","textures":[{"source":0,"sampler":0}],"samplers":[{"wrapS":33071,"wrapT":33648}],"images":[{"uri":"t.png"}],
        "extensionsUsed":["KHR_texture_transform"],"extensionsRequired":["KHR_texture_transform"]"#;
    let mesh = folder.read("a.gltf", gltf_json(r#","uri":"b%20in.bin""#, nodes, MATERIAL, extra)).unwrap();
    assert_eq!(mesh.positions, [Vec3::new(1.0, 2.0, 3.0), Vec3::new(-1.0, 2.0, 3.0), Vec3::new(1.0, 3.0, 3.0)]);
    assert_eq!(mesh.triangles, [[0, 2, 1]], "mirrored, so wound the other way");
    assert_eq!(mesh.uvs, [Vec2::ZERO, Vec2::X, Vec2::Y]);
    assert!(mesh.normals.is_empty());
    let m = &mesh.materials[0];
    assert_eq!((m.base_color, m.metallic, m.roughness), (Vec3::new(0.5, 1.0, 0.25), 0.5, 0.25));
    assert_eq!((m.emissive, m.ior, m.transmission, m.specular), (Vec3::new(8.0, 4.0, 0.0), 1.25, 0.5, 0.75));
    assert_eq!((m.thin, m.attenuation_distance, m.attenuation_color), (false, 2.0, Vec3::new(0.5, 0.5, 1.0)));
    let texture = m.base_color_texture.as_ref().unwrap();
    assert_eq!((texture.wrap_u, texture.wrap_v), (Wrap::Clamp, Wrap::Mirror));
    // A quarter turn counter-clockwise in coordinates with v down takes +u to −v.
    assert!(texture.texture_from_mesh.transform_point2(Vec2::X).distance(Vec2::new(0.5, -2.0)) < 1e-6);
}

#[test]
fn glb_and_data_uris_hold_the_same_mesh() {
    let folder = Folder::new();
    let nodes = r#"[{"mesh":0}]"#;
    let from_glb = folder.read("a.glb", glb(&gltf_json("", nodes, "{}", ""), &gltf_bin())).unwrap();
    assert_eq!(from_glb.positions, [Vec3::ZERO, Vec3::X, Vec3::Y]);
    assert_eq!((from_glb.materials[0].metallic, from_glb.materials[0].base_color), (1.0, Vec3::ONE), "glTF's defaults");
    let uri = r#","uri":"data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAAAAABAAIAAAAAAAAA/wAAAAD/AAA=""#;
    let inline = folder.read("a.gltf", gltf_json(uri, nodes, "{}", "")).unwrap();
    assert_eq!((inline.positions, inline.triangles, inline.uvs), (from_glb.positions, from_glb.triangles, from_glb.uvs));
}

#[test]
fn gltf_strips_and_fans_wind_as_specified() {
    let square = [[0.0f32, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 1.0, 0.0]];
    let folder = Folder::new();
    for (mode, order, triangles) in [(5, [0, 1, 2, 3], [[0, 1, 2], [1, 3, 2]]), (6, [0, 1, 3, 2], [[1, 2, 0], [2, 3, 0]])] {
        let bin: Vec<u8> = order.iter().flat_map(|&i: &usize| square[i]).flat_map(f32::to_le_bytes).collect();
        let json = format!(
            r#"{{"asset":{{"version":"2.0"}},"meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}},"mode":{mode}}},
            {{"attributes":{{"POSITION":0}},"mode":0}}]}}],"buffers":[{{"byteLength":48}}],"bufferViews":[{{"buffer":0,"byteLength":48}}],
            "accessors":[{{"bufferView":0,"componentType":5126,"count":4,"type":"VEC3","min":[0,0,0],"max":[1,1,0]}}]}}"#
        );
        let mesh = folder.read("a.glb", glb(&json, &bin)).unwrap();
        assert_eq!(mesh.triangles, triangles);
        assert!(mesh.flat().normals.iter().all(|n| *n == Vec3::Z), "{mode}");
    }
}

#[test]
fn damaged_and_unusable_files_are_refused_with_their_reason() {
    let ply = |vertices: &str, faces: &str| {
        format!(
            "ply\nformat ascii 1.0\nelement vertex {vertices}\nproperty float x\nproperty float y\nproperty float z\nelement face {faces}"
        )
    };
    let list = "property list uchar int vertex_indices\nend_header\n";
    let nodes = r#"[{"mesh":0}]"#;
    let gltf = |extra: &str| glb(&gltf_json("", nodes, "{}", extra), &gltf_bin());
    let edited = |from: &str, to: &str| {
        let json = gltf_json("", nodes, "{}", "");
        assert!(json.contains(from), "{from}");
        glb(&json.replace(from, to), &gltf_bin())
    };
    let textured = r#"{"pbrMetallicRoughness":{"baseColorTexture":{"index":0}}}"#;
    let images = |image: &str| {
        glb(&gltf_json("", nodes, textured, &format!(r#","textures":[{{"source":0}}],"images":[{image}]"#)), &gltf_bin())
    };
    let cases: Vec<(&str, Vec<u8>, &str)> = vec![
        ("a.ply", vec![], "not a PLY"),
        ("a.obj", vec![], "no faces"),
        ("a.gltf", vec![], "not glTF"),
        ("a.glb", b"glTF".to_vec(), "cut off"),
        ("a.stl", b"solid".to_vec(), ".stl"),
        ("mesh", b"solid".to_vec(), "not a mesh"),
        ("a.ply", binary_ply(false)[..binary_ply(false).len() - 40].to_vec(), "`vertex`"),
        ("a.ply", binary_ply(false)[..binary_ply(false).len() - 1].to_vec(), "`face`"),
        ("a.ply", format!("{}\n{list}0 0 0\n", ply("1", "0")).into_bytes(), "no faces"),
        ("a.ply", format!("{}\n{list}0 0 0\n3 0 0 1\n", ply("1", "1")).into_bytes(), "uses vertex"),
        ("a.ply", format!("{}\n{list}0 0 0\n3 0 0 -1\n", ply("1", "1")).into_bytes(), "vertex -1"),
        ("a.ply", format!("{}\n{list}0 0 0\n", ply("99999999999999", "1")).into_bytes(), "cut off"),
        ("a.ply", format!("{}\n{list}0 0 0\n4000000000 0\n", ply("1", "1")).into_bytes(), "`face`"),
        ("a.ply", b"ply\nformat ascii 1.0\nelement face 99999999999\nend_header\n".to_vec(), "declares"),
        ("a.obj", b"v 0 0 0\nf 1 2 3\n".to_vec(), "line 2: the face uses position 2 of 1"),
        ("a.obj", b"v 0 0 0\nf 0 1 1\n".to_vec(), "line 2"),
        ("a.obj", b"v 0 0 0\nf -2 1 1\n".to_vec(), "line 2"),
        ("a.obj", b"v 0 x 0\n".to_vec(), "line 1"),
        ("a.obj", b"v 0 NaN 0\nf 1 1 1\n".to_vec(), "not finite"),
        ("a.obj", b"v 0 0 0\nf 1// /1 1\n".to_vec(), "no position"),
        ("a.obj", b"mtllib none.mtl\n".to_vec(), "none.mtl"),
        ("a.glb", gltf(r#","extensionsRequired":["KHR_draco_mesh_compression"]"#), "KHR_draco_mesh_compression"),
        ("a.glb", gltf(r#","extensionsRequired":["X_unheard_of"]"#), "X_unheard_of"),
        ("a.glb", glb(&gltf_json(r#","uri":"none.bin""#, nodes, "{}", ""), &[]), "none.bin"),
        ("a.glb", glb(&gltf_json(r#","uri":"http://x.org/a""#, nodes, "{}", ""), &[]), "http"),
        ("a.glb", glb(&gltf_json("", nodes, "{}", ""), &gltf_bin()[..40]), "declares 56 bytes"),
        ("a.glb", edited(r#""byteLength":36"#, r#""byteLength":99"#), "beyond its buffer"),
        ("a.glb", edited(r#""count":3,"type":"VEC3""#, r#""count":4,"type":"VEC3""#), "do not fit"),
        ("a.glb", edited(r#""count":3,"type":"VEC3""#, r#""count":18446744073709551615,"type":"VEC3""#), "do not fit"),
        ("a.glb", edited(r#""count":3,"type":"VEC2""#, r#""count":2,"type":"VEC2""#), "2 texture coordinates"),
        ("a.glb", edited(r#""bufferView":1,"#, r#""bufferView":1,"byteOffset":18446744073709551615,"#), "do not fit"),
        ("a.glb", edited(r#""componentType":5123"#, r#""componentType":5126"#), "unsigned"),
        (
            "a.glb",
            edited(r#""bufferView":1,"componentType":5123"#, r#""bufferView":0,"byteOffset":12,"componentType":5123"#),
            "index 16256 of 3",
        ),
        ("a.glb", edited(r#""indices":1"#, r#""indices":7"#), "indices"),
        ("a.glb", edited(r#""POSITION":0"#, r#""POSITION":7"#), "accessor 7 of 3"),
        ("a.glb", edited(r#"[{"mesh":0}]"#, r#"[{"mesh":0,"children":[0]}]"#), "own ancestor"),
        ("a.glb", edited(r#"[{"mesh":0}]"#, "[{}]"), "no triangles"),
        ("a.glb", images(r#"{"uri":"none.png"}"#), "none.png"),
        ("a.glb", images(r#"{"bufferView":0}"#), "not a picture"),
        ("a.glb", images("{}"), "no source"),
    ];
    let folder = Folder::new();
    for (name, bytes, reason) in cases {
        let error = folder.read(name, &bytes).expect_err(reason);
        let message = error.to_string();
        assert!(message.contains(reason), "{name}: {message:?} does not say {reason:?}");
        assert!(message.contains(name) && error.remedy().is_some_and(|r| !r.is_empty()), "{message}");
    }
    assert!(read_mesh(&folder.0.path().join("none.ply")).unwrap_err().to_string().contains("none.ply"));
    assert!(read_mesh(folder.0.path()).is_err(), "a folder");
}

/// A few bytes that stand for a great many vertices, faces or pixels.
#[test]
fn bombs_are_refused_before_they_take_memory() {
    let mesh = |nodes: usize, count: &str, extra: &str| {
        let nodes = vec![r#"{"mesh":0}"#; nodes].join(",");
        let json = gltf_json("", &format!("[{nodes}]"), "{}", extra).replace(r#""scene":0,"scenes":[{"nodes":[0]}],"#, "");
        glb(&json.replacen(r#"{"bufferView":0,"componentType":5126,"count":3"#, count, 1), &gltf_bin())
    };
    let folder = Folder::new();
    let plain = r#"{"bufferView":0,"componentType":5126,"count":3"#;
    assert_eq!(folder.read("a.glb", mesh(1000, plain, "")).unwrap().positions.len(), 3000, "what is repeated within reason");
    let sparse = r#""sparse":{"count":1,"indices":{"bufferView":1,"componentType":5123},"values":{"bufferView":0}}"#;
    for (what, bytes) in [
        ("repeated nodes", mesh(30_000, plain, "")),
        ("zeros without end", mesh(1, &format!("{{{sparse},\"componentType\":5126,\"count\":16000000"), "")),
    ] {
        let error = folder.read("a.glb", bytes).expect_err(what).to_string();
        assert!(error.contains("unfolds") || error.contains("elements"), "{what}: {error}");
    }
    // 67 megapixels in a JPEG of some hundred bytes.
    let mut bomb = std::io::Cursor::new(Vec::new());
    ::image::RgbImage::new(8, 8).write_to(&mut bomb, ::image::ImageFormat::Jpeg).unwrap();
    let mut bomb = bomb.into_inner();
    let frame = bomb.windows(2).position(|marker| marker == [0xff, 0xc0]).unwrap();
    bomb[frame + 5..frame + 9].copy_from_slice(&[0x1f, 0xff, 0x1f, 0xff]);
    folder.file("t.jpg", bomb);
    folder.file("a.mtl", "newmtl a\nmap_Kd t.jpg\n");
    let error = folder.read("a.obj", "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").unwrap_err().to_string();
    assert!(error.contains("8191×8191 pixels"), "{error}");
}

#[cfg(unix)]
#[test]
fn devices_without_end_are_no_meshes_nor_parts_of_one() {
    let folder = Folder::new();
    folder.file("a.mtl", "newmtl a\nmap_Kd /dev/zero\n");
    for (name, bytes) in [
        ("a.obj", b"mtllib /dev/zero\n".to_vec()),
        ("b.obj", b"mtllib a.mtl\n".to_vec()),
        ("a.gltf", gltf_json(r#","uri":"/dev/zero""#, r#"[{"mesh":0}]"#, "{}", "").into_bytes()),
    ] {
        let error = folder.read(name, bytes).unwrap_err().to_string();
        assert!(error.contains("/dev/zero") && error.contains("not a regular file"), "{error}");
    }
    assert!(read_mesh(Path::new("/dev/zero")).unwrap_err().to_string().contains("not a regular file"));
}

/// Reading one again for every line that names it takes time with the square of the file.
#[test]
fn material_libraries_are_read_once() {
    let count = std::cell::Cell::new(0);
    let files = |_: &Path| {
        count.set(count.get() + 1);
        Ok(b"newmtl a\nKd 1 0 0\n".to_vec())
    };
    let text = format!("{}v 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl a\nf 1 2 3\n", "mtllib a.mtl\n".repeat(100));
    let mesh = decode_mesh(text.as_bytes(), Path::new("a.obj"), &files).unwrap();
    assert_eq!((count.get(), mesh.materials.len(), mesh.materials[0].base_color), (1, 1, Vec3::X));
}

#[test]
fn degenerate_triangles_are_kept() {
    let mesh = Folder::new().read("a.obj", "v 0 0 0\nv 1 0 0\nf 1 1 2\nf 1 2 1\n").unwrap();
    assert_eq!(mesh.triangles.len(), 2);
}

#[test]
fn textures_of_16_bits_and_hdr_are_decoded_linear() {
    use super::texture_file::{Encoding, decode};
    let encode = |picture: ::image::DynamicImage, format| {
        let mut bytes = std::io::Cursor::new(Vec::new());
        picture.write_to(&mut bytes, format).unwrap();
        bytes.into_inner()
    };
    let deep = ::image::ImageBuffer::from_raw(1, 1, vec![32768u16, 0, 65535]).unwrap();
    let deep = encode(::image::DynamicImage::ImageRgb16(deep), ::image::ImageFormat::Png);
    assert!((decode(&deep, Encoding::Data).unwrap().get(0, 0).x - 0.5).abs() < 1e-4);
    assert!((decode(&deep, Encoding::Color).unwrap().get(0, 0).x - 0.2140).abs() < 1e-3);
    let hdr = ::image::ImageBuffer::from_raw(1, 1, vec![4.0f32, 0.5, 0.0]).unwrap();
    let hdr = encode(::image::DynamicImage::ImageRgb32F(hdr), ::image::ImageFormat::Hdr);
    let pixel = decode(&hdr, Encoding::Color).unwrap().get(0, 0);
    assert!((pixel.x - 4.0).abs() < 0.05 && (pixel.y - 0.5).abs() < 0.05, "{pixel}");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]
    #[test]
    fn random_damage_never_panics(kind in 0usize..6, flips in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..8), cut in any::<Option<prop::sample::Index>>()) {
        let obj = b"mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvn 0 0 1\ns 1\nusemtl a\nf 1/1/1 2//1 -1\n".to_vec();
        let mtl = b"newmtl a\nKd 1 1 1\nNs 10\nmap_Kd -s 1 1 -o 0 0 -bm 1 t.png\nTf 1 1 1\nd 0.5\nPr 0.5\n".to_vec();
        let material = MATERIAL.replace("\n", "");
        let extra = r#","textures":[{"source":0}],"images":[{"bufferView":0,"mimeType":"image/png"}]"#;
        let (name, mut bytes) = match kind {
            0 => ("a.ply", ASCII_PLY.as_bytes().to_vec()),
            1 => ("a.ply", binary_ply(false)),
            2 => ("a.ply", binary_ply(true)),
            3 => ("a.obj", obj.clone()),
            4 => ("a.mtl", mtl.clone()),
            _ => ("a.glb", glb(&gltf_json("", r#"[{"mesh":0,"rotation":[0,0,0,1]}]"#, if flips.len() % 2 == 0 { "{}" } else { &material }, extra), &gltf_bin())),
        };
        for (place, value) in &flips {
            let i = place.index(bytes.len());
            bytes[i] = *value;
        }
        if let Some(cut) = cut {
            bytes.truncate(cut.index(bytes.len()));
        }
        let folder = Folder::new();
        folder.file("t.png", png(&[[1, 2, 3]], 1));
        folder.file("a.mtl", &mtl);
        let path = folder.file(name, &bytes);
        let path = if kind == 4 { folder.file("a.obj", &obj) } else { path };
        if let Ok(mesh) = read_mesh(&path) {
            mesh.validate().unwrap();
        }
    }
}
