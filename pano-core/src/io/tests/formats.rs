//! PNG, JPEG, HDR, PFM and depth maps.

use super::super::*;
use super::{picture, place};
use crate::camera::Projection;
use crate::color::{linear_to_srgb, srgb_to_linear};
use crate::depth::{DepthFormat, DepthKind};
use crate::io::source::MAX_SIDE;
use ::image::codecs::png::PngEncoder;
use ::image::{ExtendedColorType, ImageEncoder};
use proptest::prelude::*;

/// A PNG of the given kind, by the reference encoder.
fn png(path: &Path, bytes: &[u8], width: u32, height: u32, color: ExtendedColorType) {
    let file = std::fs::File::create(path).unwrap();
    PngEncoder::new(file).write_image(bytes, width, height, color).unwrap();
}

/// Three pixels: the palette's colours 2, 0 and 1 of (255, 0, 0), (0, 128, 0), (7, 8, 9).
const PALETTE_PNG: [u8; 91] = [
    137, 80, 78, 71, 13, 10, 26, 10, 0, 0, 0, 13, 73, 72, 68, 82, 0, 0, 0, 3, 0, 0, 0, 1, 2, 3, 0, 0, 0, 102, 142, 252, 39, 0, 0,
    0, 12, 80, 76, 84, 69, 255, 0, 0, 0, 128, 0, 7, 8, 9, 0, 0, 0, 0, 182, 247, 218, 0, 0, 0, 10, 73, 68, 65, 84, 120, 156, 99,
    104, 1, 0, 0, 134, 0, 133, 188, 245, 205, 214, 0, 0, 0, 0, 73, 69, 78, 68, 174, 66, 96, 130,
];

/// Three pixels of one bit: black, white, black.
const BIT_PNG: [u8; 67] = [
    137, 80, 78, 71, 13, 10, 26, 10, 0, 0, 0, 13, 73, 72, 68, 82, 0, 0, 0, 3, 0, 0, 0, 1, 1, 0, 0, 0, 0, 51, 155, 41, 25, 0, 0,
    0, 10, 73, 68, 65, 84, 120, 156, 99, 112, 0, 0, 0, 66, 0, 65, 41, 55, 244, 239, 0, 0, 0, 0, 73, 69, 78, 68, 174, 66, 96, 130,
];

#[test]
fn every_8_bit_code_comes_back() {
    let (_folder, path) = place("a.png");
    let codes: Vec<u8> = (0..256 * 3).map(|i| (i % 256) as u8).collect();
    png(&path, &codes, 16, 16, ExtendedColorType::Rgb8);
    let loaded = read_image(&path).unwrap();
    assert_eq!((loaded.encoding, loaded.report, loaded.alpha), (SourceEncoding::Srgb8, Sanitized::default(), None));
    write_png8(&path, &loaded.radiance, None).unwrap();
    assert_eq!(::image::open(&path).unwrap().into_rgb8().into_raw(), codes);
}

#[test]
fn every_16_bit_code_comes_back_with_its_alpha() {
    let (_folder, path) = place("a.png");
    let codes: Vec<u16> = (0..65536u32 * 4).map(|i| (i / 4 * (1 + i % 4 * 2)) as u16).collect();
    png(&path, bytemuck::cast_slice(&codes), 256, 256, ExtendedColorType::Rgba16);
    let loaded = read_image(&path).unwrap();
    assert_eq!(loaded.encoding, SourceEncoding::Srgb16);
    write_png16(&path, &loaded.radiance, loaded.alpha.as_ref()).unwrap();
    assert_eq!(::image::open(&path).unwrap().into_rgba16().into_raw(), codes);
}

#[test]
fn gray_alpha_palettes_and_bits_load() {
    let (_folder, path) = place("misnamed.jpg");
    png(&path, &[0, 255, 128, 51], 2, 1, ExtendedColorType::La8);
    let loaded = read_image(&path).unwrap();
    assert_eq!(loaded.radiance.data(), [Vec3::ZERO, Vec3::splat(srgb_to_linear(128.0 / 255.0))]);
    assert_eq!(loaded.alpha.unwrap().data(), [1.0, 0.2]);

    std::fs::write(&path, PALETTE_PNG).unwrap();
    let codes = read_image(&path).unwrap().radiance.map(|p| p.map(|x| (linear_to_srgb(x) * 255.0).round()));
    assert_eq!(codes.data(), [Vec3::new(7.0, 8.0, 9.0), Vec3::new(255.0, 0.0, 0.0), Vec3::new(0.0, 128.0, 0.0)]);

    std::fs::write(&path, BIT_PNG).unwrap();
    assert_eq!(read_image(&path).unwrap().radiance.data(), [Vec3::ZERO, Vec3::ONE, Vec3::ZERO]);
}

#[test]
fn jpeg_keeps_a_smooth_picture() {
    let (_folder, path) = place("a.JPEG");
    let image = Image::from_fn(64, 32, |x, y| Vec3::new(x as f32 / 64.0, y as f32 / 32.0, 0.5));
    write_image(&path, &image, None).unwrap();
    let loaded = read_image(&path).unwrap();
    assert_eq!(loaded.encoding, SourceEncoding::Srgb8);
    let error = image.data().iter().zip(loaded.radiance.data()).map(|(a, b)| a.distance(*b)).fold(0.0, f32::max);
    assert!(error < 0.06, "{error}");
}

#[test]
fn unknown_extensions_name_the_known_ones() {
    for name in ["a.tif", "a", "png"] {
        let (folder, path) = place(name);
        let error = write_image(&path, &picture(2, 2), None).unwrap_err();
        for known in IMAGE_EXTENSIONS {
            assert!(error.remedy().unwrap().contains(known), "{name}: {error}");
        }
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
    }
}

#[test]
fn sizes_that_do_not_fit_are_refused() {
    let (_folder, path) = place("a.png");
    assert!(write_png8(&path, &picture(2, 2), Some(&Image::filled(1, 2, 1.0))).is_err());
    assert!(write_image(&path, &Image::filled(MAX_SIDE + 1, 1, Vec3::ZERO), None).is_err());
}

#[test]
fn what_is_not_radiance_is_set_to_0_and_counted() {
    let (_folder, path) = place("a.pfm");
    let bad = [Vec3::new(f32::NAN, -1.0, 2.0), Vec3::new(f32::INFINITY, f32::NEG_INFINITY, -0.5), Vec3::new(0.0, 1e-40, 1e30)];
    write_pfm(&path, &Image::from_vec(3, 1, bad.to_vec()).unwrap()).unwrap();
    let loaded = read_image(&path).unwrap();
    assert_eq!(loaded.report, Sanitized { negative: 2, not_finite: 3 });
    assert_eq!(loaded.radiance.data(), [Vec3::new(0.0, 0.0, 2.0), Vec3::ZERO, Vec3::new(0.0, 1e-40, 1e30)]);
}

#[test]
fn pfm_reads_both_byte_orders_and_gray() {
    let (_folder, path) = place("a.pfm");
    // Rows from bottom to top.
    for (order, bytes) in [("-1", [1.0f32, 2.0].map(f32::to_le_bytes)), ("1.0", [1.0, 2.0].map(f32::to_be_bytes))] {
        std::fs::write(&path, [format!("Pf\n1 2\n{order}\n").as_bytes(), bytes.concat().as_slice()].concat()).unwrap();
        assert_eq!(read_image(&path).unwrap().radiance.data(), [Vec3::splat(2.0), Vec3::ONE], "{order}");
        let depth = read_depth(&path, &DepthFormat::default(), Projection::Panorama).unwrap();
        assert_eq!(depth.image().data(), [2.0, 1.0]);
    }
}

#[test]
fn hdr_of_any_width_comes_back_and_xyz_is_refused() {
    let (_folder, path) = place("a.hdr");
    for width in [1, 2, 7, 8, 300] {
        let image = picture(width, 5);
        write_hdr(&path, &image).unwrap();
        let loaded = read_image(&path).unwrap();
        assert_eq!((loaded.encoding, loaded.radiance.size()), (SourceEncoding::LinearFloat, image.size()));
        for (a, b) in image.data().iter().zip(loaded.radiance.data()) {
            assert!((a - b).abs().max_element() <= a.max_element() / 128.0, "width {width}: {a} {b}");
        }
    }
    let text = String::from_utf8_lossy(&std::fs::read(&path).unwrap()[..60]).replace("rgbe", "xyze");
    std::fs::write(&path, text).unwrap();
    assert!(read_image(&path).unwrap_err().to_string().contains("XYZ"));
}

#[test]
fn depth_codes_of_gray_pngs_are_taken_as_they_are() {
    let (_folder, path) = place("depth.png");
    let codes = [0u16, 512, 1024, 65535];
    png(&path, bytemuck::cast_slice(&codes), 4, 1, ExtendedColorType::L16);
    let stanford = DepthFormat::preset("stanford2d3ds").unwrap();
    let depth = read_depth(&path, &stanford, Projection::Panorama).unwrap();
    assert_eq!(depth.image().data(), [f32::INFINITY, 1.0, 2.0, f32::INFINITY]);
    assert_eq!(depth.finite_pixels(), 2);
    png(&path, &[0, 100], 2, 1, ExtendedColorType::L8);
    let format = DepthFormat { kind: DepthKind::Disparity, scale: 50.0, invalid: vec![] };
    assert_eq!(read_depth(&path, &format, Projection::Panorama).unwrap().image().data(), [f32::INFINITY, 0.5]);
}

#[test]
fn pictures_are_no_depth_maps() {
    let (_folder, path) = place("a.png");
    let refused = |what: &str| {
        let error = read_depth(&path, &DepthFormat::default(), Projection::Panorama).unwrap_err();
        assert!(error.to_string().contains("depth") && error.remedy().is_some(), "{what}: {error}");
    };
    for (what, bytes) in [("palette", PALETTE_PNG.as_slice()), ("bits", BIT_PNG.as_slice())] {
        std::fs::write(&path, bytes).unwrap();
        refused(what);
    }
    write_png16(&path, &picture(2, 2), None).unwrap();
    refused("rgb");
    write_jpeg(&path, &picture(8, 8), 90).unwrap();
    refused("jpeg");
    write_pfm(&path, &picture(2, 2)).unwrap();
    refused("colour pfm");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(32))]
    #[test]
    fn pfm_is_lossless(w in 1usize..20, h in 1usize..20) {
        let (_folder, path) = place("a.pfm");
        let image = picture(w, h);
        write_image(&path, &image, None).unwrap();
        prop_assert_eq!(read_image(&path).unwrap().radiance, image);
    }
}
