//! EXR: every kind of file the reader takes, and the writer.

use super::super::*;
use super::{picture, place};
use crate::camera::Projection;
use crate::depth::{DepthFormat, DepthKind};
use crate::image::Image;
use ::exr::prelude::*;
use proptest::prelude::*;
use std::path::Path;

type Channel = AnyChannel<FlatSamples>;

/// Channels R, G, B (floats of the given type) of a smooth picture, and an integer id.
fn channels(size: (usize, usize), half: bool) -> Vec<Channel> {
    let wave = move |i: usize, c: usize| ((i % size.0) as f32 * 0.05 + (i / size.0) as f32 * 0.03 + c as f32).sin();
    let values = |c: usize| (0..size.0 * size.1).map(move |i| 2.0 + wave(i, c));
    let samples = |c: usize| match half {
        true => FlatSamples::F16(values(c).map(f16::from_f32).collect()),
        false => FlatSamples::F32(values(c).collect()),
    };
    let mut list: Vec<_> = ["R", "G", "B"].iter().enumerate().map(|(c, name)| AnyChannel::new(*name, samples(c))).collect();
    list.push(AnyChannel::new("id", FlatSamples::U32((0..(size.0 * size.1) as u32).collect())));
    list
}

fn layer(name: &str, size: (usize, usize), encoding: Encoding, channels: Vec<Channel>) -> Layer<AnyChannels<FlatSamples>> {
    Layer::new(size, LayerAttributes::named(name), encoding, AnyChannels::sort(channels.into_iter().collect()))
}

fn write_layers(path: &Path, layers: Vec<Layer<AnyChannels<FlatSamples>>>) {
    let size = layers[0].size;
    ::exr::image::Image::from_layers(ImageAttributes::with_size(size), layers).write().to_file(path).unwrap();
}

fn encoding(compression: Compression, blocks: Blocks) -> Encoding {
    Encoding { compression, blocks, line_order: LineOrder::Increasing }
}

#[test]
fn all_compressions_types_and_block_layouts_load() {
    let size = (67, 45);
    let (_folder, path) = place("a.exr");
    // Largest relative error that the compression is allowed.
    let compressions = [
        (Compression::Uncompressed, 0.0),
        (Compression::RLE, 0.0),
        (Compression::ZIP1, 0.0),
        (Compression::ZIP16, 0.0),
        (Compression::PIZ, 0.0),
        (Compression::PXR24, 1e-4),
        (Compression::B44, 0.05),
        (Compression::B44A, 0.05),
        (Compression::DWAA(None), 0.05),
        (Compression::DWAB(None), 0.05),
    ];
    for (compression, tolerance) in compressions {
        for half in [false, true] {
            for blocks in [Blocks::ScanLines, Blocks::Tiles(Vec2(16, 32))] {
                let source = channels(size, half);
                write_layers(&path, vec![layer("a", size, encoding(compression, blocks), source.clone())]);
                let file = read_exr(&path).unwrap();
                assert_eq!((file.width, file.height, file.channels.len()), (67, 45, 4));
                for channel in &source {
                    let got = file.get(&channel.name.to_string()).unwrap();
                    for (i, got) in got.data().iter().enumerate() {
                        let want = channel.sample_data.value_by_flat_index(i).to_f32();
                        assert!((got - want).abs() <= tolerance * want, "{compression:?} {half} {blocks:?}: {got} {want}");
                    }
                }
            }
        }
    }
}

#[test]
fn the_display_window_is_the_picture() {
    let (_folder, path) = place("a.exr");
    let red = AnyChannel::new("Y", FlatSamples::F32((0..12).map(|i| i as f32 + 1.0).collect()));
    // 4×3 pixels of data, of which the columns 2, 3 and the rows 0, 1 lie in a picture of 3×4 at its rows 2, 3.
    let mut data = layer("a", (4, 3), Encoding::default(), vec![red]);
    data.attributes.layer_position = Vec2(-2 + 10, 2 - 5);
    let window = IntegerBounds::new((10, -5), (3, 4));
    let image = ::exr::image::Image::from_layer(data);
    let image = ::exr::image::Image { attributes: ImageAttributes::new(window), ..image };
    image.write().to_file(&path).unwrap();
    let file = read_exr(&path).unwrap();
    let want = [[0.0, 0.0, 0.0], [0.0, 0.0, 0.0], [3.0, 4.0, 0.0], [7.0, 8.0, 0.0]];
    assert_eq!(file.get("Y").unwrap().data(), want.concat());
    assert_eq!(read_image(&path).unwrap().radiance.get(1, 3), Vec3::splat(8.0));
}

#[test]
fn parts_and_layers_are_merged_and_the_picture_found() {
    let (_folder, path) = place("a.exr");
    let plain = |name: &str, value: f32| AnyChannel::new(name, FlatSamples::F32(vec![value; 6]));
    let size = (3, 2);
    write_layers(
        &path,
        vec![
            layer("depth", size, Encoding::default(), vec![plain("Z", 5.0)]),
            layer("left", size, Encoding::default(), vec![plain("R", 1.0), plain("G", 2.0), plain("B", 3.0)]),
            layer("right", size, Encoding::default(), vec![plain("R", 4.0), plain("A", 0.5)]),
        ],
    );
    let file = read_exr(&path).unwrap();
    let values: Vec<_> = file.channels.iter().map(|(name, image)| (name.as_str(), image.get(0, 0))).collect();
    assert_eq!(values, [("B", 3.0), ("G", 2.0), ("R", 1.0), ("Z", 5.0), ("A", 0.5), ("right.R", 4.0)]);
    let depth = read_depth(&path, &DepthFormat::default(), Projection::Panorama).unwrap();
    assert_eq!(depth.get(2, 1), 5.0);

    let named = ["Combined.B", "Combined.G", "Combined.R", "Combined.A", "Depth.Z"].map(|n| plain(n, n.len() as f32));
    write_layers(&path, vec![layer("a", size, Encoding::default(), named.to_vec())]);
    let loaded = read_image(&path).unwrap();
    assert_eq!((loaded.radiance.get(0, 0), loaded.alpha.unwrap().get(0, 0)), (Vec3::splat(10.0), 1.0));
    assert_eq!(read_depth(&path, &DepthFormat::default(), Projection::Panorama).unwrap().get(0, 0), 7.0);
    assert!(read_exr(&path).unwrap().rgb("Combined").is_some_and(|rgb| rgb.get(0, 0) == Vec3::splat(10.0)));
}

#[test]
fn other_primaries_are_converted() {
    let (_folder, path) = place("a.exr");
    let plain = |name: &str, value: f32| AnyChannel::new(name, FlatSamples::F32(vec![value; 1]));
    let data = layer("a", (1, 1), Encoding::default(), vec![plain("R", 1.0), plain("G", 0.0), plain("B", 0.0)]);
    let mut image = ::exr::image::Image::from_layer(data);
    let (red, green, blue) = (Vec2(0.708, 0.292), Vec2(0.170, 0.797), Vec2(0.131, 0.046));
    let rec2020 = attribute::Chromaticities { red, green, blue, white: Vec2(0.3127, 0.3290) };
    image.attributes.chromaticities = Some(rec2020);
    image.write().to_file(&path).unwrap();
    let loaded = read_image(&path).unwrap();
    assert!((loaded.radiance.get(0, 0) - Vec3::new(1.6605, 0.0, 0.0)).length() < 1e-3);
    assert_eq!(loaded.report.negative, 2, "Rec.2020 red lies outside Rec.709");
}

#[test]
fn subsampling_and_missing_channels_are_refused() {
    let (_folder, path) = place("a.exr");
    let mut chroma = AnyChannel::new("RY", FlatSamples::F32(vec![0.0; 4]));
    chroma.sampling = Vec2(2, 2);
    let luma = AnyChannel::new("Y", FlatSamples::F32(vec![0.5; 16]));
    let mut bytes = Vec::new();
    let data = layer("a", (4, 4), encoding(Compression::Uncompressed, Blocks::ScanLines), vec![chroma.clone(), luma]);
    // The reference crate may not write subsampled files; then there is a header only, which is refused all the same.
    if ::exr::image::Image::from_layer(data).write().to_buffered(std::io::Cursor::new(&mut bytes)).is_ok() {
        std::fs::write(&path, &bytes).unwrap();
        assert!(read_image(&path).unwrap_err().to_string().contains("subsampled"));
    }
    let lone = |name: &str| AnyChannel::new(name, FlatSamples::F32(vec![0.5; 4]));
    write_layers(&path, vec![layer("a", (2, 2), Encoding::default(), vec![lone("motion.U"), lone("motion.V")])]);
    let depth = read_depth(&path, &DepthFormat::default(), Projection::Panorama).map(drop);
    for error in [read_image(&path).map(drop).unwrap_err(), depth.unwrap_err()] {
        assert!(error.to_string().contains("motion.U, motion.V"), "{error}");
    }
}

#[test]
fn written_channels_come_back_with_attributes_and_the_same_bytes() {
    let (_folder, path) = place("a.exr");
    let [r, g, b] = split_channels(&picture(37, 21));
    let signed = r.map(|v| -v);
    let list = [("shadow.lamp.V", &g), ("R", &r), ("delta.R", &signed), ("object.A", &b), ("Z", &g)];
    let attributes = [(DEPTH_KIND_ATTRIBUTE, "ray"), ("pano:method", "dpt"), ("pano:é", "ü"), ("empty", "")];
    write_exr(&path, &list, &attributes).unwrap();
    let first = std::fs::read(&path).unwrap();
    for _ in 0..4 {
        write_exr(&path, &list, &attributes).unwrap();
        assert_eq!(std::fs::read(&path).unwrap(), first);
    }
    let file = read_exr(&path).unwrap();
    let names: Vec<_> = file.channels.iter().map(|(name, _)| name.as_str()).collect();
    assert_eq!(names, ["R", "Z", "delta.R", "object.A", "shadow.lamp.V"]);
    for (name, image) in list {
        assert_eq!(file.get(name), Some(image), "{name}");
    }
    for (name, value) in attributes {
        assert_eq!(file.attribute(name), Some(value));
    }
}

#[test]
fn a_stated_depth_kind_must_be_the_declared_one() {
    let (_folder, path) = place("a.exr");
    write_exr(&path, &[("Z", &Image::filled(2, 1, 1.5))], &[(DEPTH_KIND_ATTRIBUTE, "z")]).unwrap();
    let perspective = Projection::Perspective { vfov: 1.0 };
    let error = read_depth(&path, &DepthFormat::default(), perspective).unwrap_err();
    assert!(error.to_string().contains("\"z\"") && error.to_string().contains("\"ray\""), "{error}");
    let format = DepthFormat { kind: DepthKind::Z, ..DepthFormat::default() };
    assert!(read_depth(&path, &format, perspective).unwrap().get(0, 0) > 1.5);
}

#[test]
fn lists_the_format_cannot_hold_are_refused() {
    let (folder, path) = place("a.exr");
    let (a, b) = (Image::filled(2, 1, 0.0), Image::filled(1, 1, 0.0));
    let long = "n".repeat(256);
    let none: [(&str, &Image<f32>); 0] = [];
    assert!(write_exr(&path, &none, &[]).is_err());
    for list in [[("R", &a), ("R", &a)], [("R", &a), ("G", &b)], [("", &a), ("G", &a)], [(&long, &a), ("\0", &a)]] {
        assert!(write_exr(&path, &list, &[]).is_err(), "{list:?}");
    }
    for attributes in
        [[("name", "x"), ("b", "")], [("a", ""), ("a", "")], [("", ""), ("b", "")], [("chromaticities", ""), ("b", "")]]
    {
        assert!(write_exr(&path, &[("R", &a)], &attributes).is_err(), "{attributes:?}");
    }
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(32))]
    #[test]
    fn pictures_are_lossless(w in 1usize..40, h in 1usize..40, with_alpha: bool) {
        let (_folder, path) = place("a.exr");
        let image = picture(w, h);
        let alpha = with_alpha.then(|| image.map(|p| p.x.min(1.0)));
        write_image(&path, &image, alpha.as_ref()).unwrap();
        let loaded = read_image(&path).unwrap();
        prop_assert_eq!(loaded.radiance, image);
        prop_assert_eq!(loaded.alpha, alpha);
        prop_assert!(loaded.report.is_clean());
    }
}
