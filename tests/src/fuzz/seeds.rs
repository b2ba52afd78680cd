//! Small valid files of every kind that the readers take: written by the program itself where it writes that kind. The few in
//! `files/` are of kinds that none of the libraries here writes; Pillow 12 made them of a picture of 33×19 pixels.

use exr::prelude::{
    AnyChannel, AnyChannels, Blocks, Compression, Encoding, FlatSamples, Layer, LayerAttributes, LineOrder, Vec2 as Size,
    WritableImage, f16,
};
use glam::Vec3;
use pano_core::image::{Image, RadianceImage};
use pano_core::io;
use std::io::Cursor;
use std::path::Path;

/// A picture whose pixels all differ.
fn picture() -> RadianceImage {
    Image::from_fn(19, 9, |x, y| Vec3::new(x as f32 * 0.1, y as f32 * 0.07, (y * 19 + x) as f32 * 0.01))
}

fn alpha() -> Image<f32> {
    picture().map(|p| p.x / 2.0)
}

/// What a writer makes of a file of that name.
fn written(name: &str, write: impl FnOnce(&Path) -> pano_core::Result<()>) -> Vec<u8> {
    let folder = tempfile::tempdir().expect("a folder for temporary files");
    let path = folder.path().join(name);
    write(&path).expect("the seed is valid");
    std::fs::read(&path).expect("it was written")
}

pub(super) fn exr() -> Vec<Vec<u8>> {
    let alpha = alpha();
    let [r, g, b] = io::split_channels(&picture());
    let mut files = vec![
        written("a.exr", |p| io::write_exr(p, &[("R", &r), ("G", &g), ("B", &b), ("A", &alpha)], &[])),
        written("a.exr", |p| io::write_exr(p, &[("Z", &alpha), ("delta.R", &r)], &[(io::DEPTH_KIND_ATTRIBUTE, "ray")])),
    ];
    let layer = |compression, blocks, name: &str| {
        let half = |image: &Image<f32>| FlatSamples::F16(image.data().iter().map(|v| f16::from_f32(*v)).collect());
        let ids = FlatSamples::U32((0..19 * 9).collect());
        let channels = [
            AnyChannel::new("R", half(&r)),
            AnyChannel::new("Y", FlatSamples::F32(g.data().to_vec())),
            AnyChannel::new("id", ids),
        ];
        let encoding = Encoding { compression, blocks, line_order: LineOrder::Increasing };
        Layer::new((19, 9), LayerAttributes::named(name), encoding, AnyChannels::sort(channels.into_iter().collect()))
    };
    let in_memory = |image: exr::image::Image<exr::image::Layers<AnyChannels<FlatSamples>>>| {
        let mut bytes = Vec::new();
        image.write().to_buffered(Cursor::new(&mut bytes)).expect("the seed is valid");
        bytes
    };
    let attributes = || exr::meta::header::ImageAttributes::with_size((19, 9));
    use Compression::{B44, B44A, DWAA, DWAB, PIZ, PXR24, RLE, Uncompressed, ZIP1};
    for compression in [Uncompressed, RLE, ZIP1, PIZ, PXR24, B44, B44A, DWAA(None), DWAB(None)] {
        for blocks in [Blocks::ScanLines, Blocks::Tiles(Size(8, 8))] {
            files.push(in_memory(exr::image::Image::from_layers(attributes(), vec![layer(compression, blocks, "a")])));
        }
    }
    let parts = vec![layer(ZIP1, Blocks::ScanLines, "a"), layer(RLE, Blocks::Tiles(Size(8, 8)), "b")];
    files.push(in_memory(exr::image::Image::from_layers(attributes(), parts)));
    files
}

pub(super) fn hdr() -> Vec<Vec<u8>> {
    // Rows of fewer than 8 pixels are not packed.
    let flat = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\nEXPOSURE=2\n\n-Y 1 +X 2\n\x80\x40\x20\x81\x01\x02\x03\x80".to_vec();
    vec![written("a.hdr", |p| io::write_hdr(p, &picture())), flat]
}

/// A PNG of one pixel.
pub(super) fn texture() -> Vec<u8> {
    written("t.png", |p| io::write_png8(p, &Image::from_fn(1, 1, |_, _| Vec3::new(0.1, 0.2, 0.3)), None))
}

pub(super) fn png() -> Vec<Vec<u8>> {
    vec![
        written("a.png", |p| io::write_png8(p, &picture(), None)),
        written("a.png", |p| io::write_png8(p, &picture(), Some(&alpha()))),
        written("a.png", |p| io::write_png16(p, &picture(), None)),
        include_bytes!("files/palette.png").to_vec(),
        include_bytes!("files/bits.png").to_vec(),
    ]
}

pub(super) fn jpeg() -> Vec<Vec<u8>> {
    vec![
        written("a.jpg", |p| io::write_jpeg(p, &picture(), 90)),
        include_bytes!("files/progressive.jpg").to_vec(),
        include_bytes!("files/cmyk.jpg").to_vec(),
    ]
}

pub(super) fn pfm() -> Vec<Vec<u8>> {
    let gray = [&b"Pf\n2 1\n1.0\n"[..], &1.5f32.to_be_bytes(), &f32::NAN.to_be_bytes()].concat();
    vec![written("a.pfm", |p| io::write_pfm(p, &picture())), gray]
}

pub(super) fn ply() -> Vec<Vec<u8>> {
    let text = "ply\nformat ascii 1.0\ncomment a square\nelement vertex 5\nproperty float x\nproperty double y\nproperty float z\n\
        property uchar red\nproperty float s\nproperty float t\nelement face 2\nproperty list uchar int vertex_indices\n\
        property uchar flags\nelement edge 1\nproperty int vertex1\nend_header\n\
        0 0 0 255 0 0\n0 0 1 255 0 1\n1 0 1 0 1 1\n1 0 0 0 1 0\n0.5 1 0.5 0 0.5 0.5\n4 0 1 2 3 7\n3 0 1 4 0\n1\n";
    let binary = |big: bool| {
        let order = if big { "big" } else { "little" };
        let header = format!(
            "ply\nformat binary_{order}_endian 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
             property float nx\nproperty float ny\nproperty float nz\nelement face 2\nproperty list uchar uint vertex_index\n\
             property list int double weights\nend_header\n"
        );
        let vertices = [[0.0f32, 0.0, 0.0, 0.0, 0.0, 2.0], [1.0, 0.0, 0.0, 0.0, 0.0, 1.0], [0.0, 1.0, 0.0, 0.0, 0.0, 0.0]];
        let mut numbers: Vec<Vec<u8>> = vertices.as_flattened().iter().map(|x| x.to_le_bytes().to_vec()).collect();
        for corners in [[0u32, 1, 2], [2, 1, 0]] {
            numbers.push(vec![3]);
            numbers.extend(corners.map(|corner| corner.to_le_bytes().to_vec()));
            numbers.push(1i32.to_le_bytes().to_vec());
            numbers.push(0.5f64.to_le_bytes().to_vec());
        }
        if big {
            numbers.iter_mut().for_each(|number| number.reverse());
        }
        [header.into_bytes(), numbers.concat()].concat()
    };
    vec![text.into(), binary(false), binary(true)]
}

pub(super) fn obj() -> Vec<Vec<u8>> {
    let mesh = "mtllib a.mtl\no square\nv 0 0 0\nv 0 0 1 0.5 0.5 0.5\nv 1 0 1\nv 1 0 0\nvt 0 0\nvt 0 1\nvt 1\nvn 0 2 0\ns 1\nusemtl wood\n\
        f -4/-3/-1 2/2/1 \\\n3/3/1 4//1\ns off\nusemtl glass\nf 1 2 4\nl 1 2\n";
    let library = "newmtl wood\nKd 0.5 0.5 0.5\nKs 0.25 0.25 0.25\nNs 30\nmap_Kd -s 2 3 1 -o 0 0 -clamp on t.png\nbump -bm 0.5 t.png\n\
        newmtl glass\nKd 0 0 0\nTf 1 0.5 1\nd 0.1\nNi 1.4\nillum 7\nKe 3 2 1\nmap_Ke t.png\nnewmtl pbr\nPr 0.5\nPm 1\nmap_Pr t.png\n";
    vec![[mesh, library].join("\0").into(), "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n".into()]
}

/// A GLB file of those chunks.
fn glb(json: &str, binary: &[u8]) -> Vec<u8> {
    let mut json = json.as_bytes().to_vec();
    json.resize(json.len().next_multiple_of(4), b' ');
    let length = 28 + json.len() + binary.len();
    let chunk = |kind: &[u8; 4], data: &[u8]| [&(data.len() as u32).to_le_bytes(), &kind[..], data].concat();
    [b"glTF\x02\0\0\0", &(length as u32).to_le_bytes()[..], &chunk(b"JSON", &json), &chunk(b"BIN\0", binary)].concat()
}

pub(super) fn gltf() -> Vec<Vec<u8>> {
    let positions = [0.0f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0];
    let mut binary: Vec<u8> = positions.iter().flat_map(|x| x.to_le_bytes()).collect();
    binary.extend([0, 0, 1, 0, 2, 0, 0, 0, 0, 0, 0, 0, 255, 0, 0, 0, 0, 255, 0, 0]);
    binary.extend(texture());
    let full = format!(
        r#"{{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"nodes":[0]}}],"nodes":[{{"mesh":0,"children":[1]}},
        {{"mesh":0,"rotation":[0,0,0,1],"scale":[-2,1,1]}}],"meshes":[{{"primitives":[{{"attributes":{{"POSITION":0,"TEXCOORD_0":2}},
        "indices":1,"material":0}},{{"attributes":{{"POSITION":3}},"mode":5}}]}}],
        "materials":[{{"pbrMetallicRoughness":{{"baseColorFactor":[0.5,1,0.25,1],"metallicFactor":0.5,
        "baseColorTexture":{{"index":0,"extensions":{{"KHR_texture_transform":{{"offset":[0.5,0],"rotation":1.5,"scale":[2,1]}}}}}}}},
        "emissiveFactor":[1,0.5,0],"extensions":{{"KHR_materials_ior":{{"ior":1.25}},
        "KHR_materials_emissive_strength":{{"emissiveStrength":8}},"KHR_materials_transmission":{{"transmissionFactor":0.5}},
        "KHR_materials_specular":{{"specularFactor":0.75}},"KHR_materials_volume":{{"thicknessFactor":1,"attenuationDistance":2}}}}}}],
        "textures":[{{"source":0,"sampler":0}}],"samplers":[{{"wrapS":33071,"wrapT":33648}}],
        "images":[{{"bufferView":3,"mimeType":"image/png"}}],
        "accessors":[{{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[1,1,0]}},
        {{"bufferView":1,"componentType":5123,"count":3,"type":"SCALAR"}},
        {{"bufferView":2,"componentType":5121,"normalized":true,"count":3,"type":"VEC2"}},
        {{"componentType":5126,"count":9,"type":"VEC3","min":[0,0,0],"max":[1,1,0],"sparse":{{"count":2,
        "indices":{{"bufferView":1,"componentType":5123}},"values":{{"bufferView":0}}}}}}],
        "bufferViews":[{{"buffer":0,"byteLength":36}},{{"buffer":0,"byteOffset":36,"byteLength":6}},
        {{"buffer":0,"byteOffset":44,"byteLength":12,"byteStride":4}},{{"buffer":0,"byteOffset":56,"byteLength":{}}}],
        "buffers":[{{"byteLength":{}}}]}}"#,
        texture().len(),
        binary.len()
    );
    let inline = r#"{"asset":{"version":"2.0"},"meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],
        "accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[1,1,0]}],
        "bufferViews":[{"buffer":0,"byteLength":36}],"buffers":[{"byteLength":36,
        "uri":"data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA"}]}"#;
    vec![glb(&full, &binary), inline.into()]
}

pub(super) fn scene() -> Vec<Vec<u8>> {
    let full = r#"
[panorama]
color = "pano_color.exr"
depth = "pano_depth.exr"
depth_format = { kind = "ray", scale = 1.0, invalid = 0.0 }
position = [0.3, 1.4, 4.2]
heading = 10
convention = "mitsuba"
camera_height = 1.6
fps = 25.0
[[proxy]]
plane = { size = [6.0, 5.0] }
albedo = [0.5, 0.5, 0.5]
[[marker]]
family = "tag36h11"
id = 3
size = 0.2
[[object]]
mesh = "bunny.ply"
marker = 3
yaw = 20.0
scale = 0.5
material = { base_color = [0.7, 0.6, 0.5], roughness = 0.5, ior = 1.3, thin = true, emissive = [0, 2.5, 0] }
keyframes = [ { time = 0.0, yaw = 0.0 }, { time = 2.0, rotation = [0, 2, 0, 0], scale = 2.0 } ]
[view]
kind = "perspective"
pitch = -29.0
vfov = 38.0
size = [512, 256]
[render]
method = "iprt"
samples = 128
"#;
    let camera = "[camera]\ncolor = \"c.png\"\ndepth = \"d.png\"\ndepth_format = \"kinect\"\nfx = 525\nfy = 525\ncx = 319.5\ncy = 239.5\n\
        [panorama]\nframes = \"f_%04d.exr\"\n[[object]]\nmesh = \"a.glb\"\nrotation = [0, 0, 0, 1]\n";
    vec![full.into(), camera.into()]
}
