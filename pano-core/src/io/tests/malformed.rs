//! Damaged files of every format: an error or a picture, never a panic, a hang or a huge allocation.

use super::super::{
    decode_depth, decode_exr, decode_image, write_exr, write_hdr, write_image, write_jpeg, write_pfm, write_png16,
};
use super::{picture, place};
use crate::camera::Projection;
use crate::depth::DepthFormat;
use crate::image::Image;
use proptest::prelude::*;
use std::path::Path;
use std::sync::LazyLock;

use ::exr::prelude::*;

/// A small valid file of every format and, for EXR, of every compression, with how many of its last bytes the format can do
/// without.
static SAMPLES: LazyLock<Vec<(String, Vec<u8>, usize)>> = LazyLock::new(|| {
    let image = picture(19, 9);
    let alpha = image.map(|p| p.x);
    let write = |name: &str, spare: usize, write: &dyn Fn(&Path) -> crate::Result<()>| {
        let (_folder, path) = place(name);
        write(&path).unwrap();
        (name.to_owned(), std::fs::read(&path).unwrap(), spare)
    };
    let mut samples = vec![
        // A PNG ends in a checksum of the pixels, one of their chunk, and the chunk IEND.
        write("8.png", 20, &|p| write_image(p, &image, Some(&alpha))),
        write("16.png", 20, &|p| write_png16(p, &image, None)),
        write("a.jpg", 0, &|p| write_jpeg(p, &image, 90)),
        write("a.hdr", 0, &|p| write_hdr(p, &image)),
        write("a.pfm", 0, &|p| write_pfm(p, &image)),
        write("a.exr", 0, &|p| write_exr(p, &[("Z", &alpha), ("delta.R", &alpha)], &[("a", "text")])),
    ];
    let half = || FlatSamples::F16(alpha.data().iter().map(|v| f16::from_f32(*v)).collect());
    for compression in [Compression::RLE, Compression::PIZ, Compression::PXR24, Compression::B44, Compression::DWAB(None)] {
        for blocks in [Blocks::ScanLines, Blocks::Tiles(Vec2(8, 8))] {
            let channels = ["R", "G", "B"].iter().map(|name| AnyChannel::new(*name, half())).collect();
            let encoding = Encoding { compression, blocks, line_order: LineOrder::Increasing };
            let layer = Layer::new((19, 9), LayerAttributes::named("a"), encoding, AnyChannels::sort(channels));
            let mut bytes = Vec::new();
            ::exr::image::Image::from_layer(layer).write().to_buffered(std::io::Cursor::new(&mut bytes)).unwrap();
            samples.push((format!("{compression:?} {blocks:?}"), bytes, 0));
        }
    }
    samples
});

/// Runs every reader; says whether one took it for a picture or a depth map.
fn loads(bytes: Vec<u8>) -> bool {
    let (bytes, name) = (&bytes[..], Path::new("damaged"));
    let finite = |image: &Image<f32>| assert!(image.width() > 0 && image.height() > 0);
    let picture = decode_image(bytes, name);
    if let Ok(picture) = &picture {
        assert!(picture.radiance.data().iter().all(|p| p.is_finite() && p.min_element() >= 0.0));
    }
    let depth = decode_depth(bytes, name, &DepthFormat::default(), Projection::Panorama);
    depth.iter().for_each(|depth| finite(depth.image()));
    let channels = decode_exr(bytes, name);
    channels.iter().flat_map(|c| &c.channels).for_each(|(_, image)| finite(image));
    [picture.map(drop), depth.map(drop), channels.map(drop)].into_iter().any(|result| match result {
        Ok(()) => true,
        Err(error) => {
            assert!(error.to_string().starts_with("damaged: ") && error.remedy().is_some(), "{error}");
            false
        }
    })
}

#[test]
fn the_samples_load_and_no_shorter_part_of_them_does() {
    for (name, bytes, spare) in SAMPLES.iter() {
        assert!(loads(bytes.clone()), "{name}");
        for length in (0..bytes.len() - spare).step_by(1 + bytes.len() / 97) {
            assert!(!loads(bytes[..length].to_vec()), "{name}: {length} of {} bytes", bytes.len());
        }
    }
}

#[test]
fn garbage_is_no_picture() {
    for bytes in [&b""[..], b"P", b"PF", b"PF\n", b"#?", b"GIF89a", b"hello, world", &[0; 100], &[0xff; 100], b"\x76\x2f\x31\x01"]
    {
        assert!(!loads(bytes.to_vec()), "{bytes:?}");
    }
}

#[test]
fn declared_sizes_are_checked_before_memory_is_taken() {
    let pfm = |size: &str| format!("PF\n{size}\n-1\n").into_bytes();
    let hdr = |size: &str| format!("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n{size}\n").into_bytes();
    for bytes in [
        pfm("32768 32768"),
        pfm("4294967295 4294967295"),
        pfm("0 5"),
        pfm("99999999999 1"),
        pfm("-1 1"),
        hdr("-Y 32768 +X 32768"),
        hdr("-Y 4000000000 +X 4000000000"),
        hdr("-Y 0 +X 0"),
    ] {
        assert!(!loads(bytes.clone()), "{}", String::from_utf8_lossy(&bytes));
    }
    // A PNG's and a JPEG's size lie at known places; the checksum of a PNG's header comes after the check or fails.
    let sample = |name: &str| SAMPLES.iter().find(|(n, ..)| n == name).unwrap().1.clone();
    let mut png = sample("8.png");
    png[16..24].copy_from_slice(&[0, 0, 0x80, 0, 0, 0, 0x80, 0]);
    assert!(!loads(png));
    let mut jpeg = sample("a.jpg");
    let frame = jpeg.windows(2).position(|m| m == [0xff, 0xc0]).unwrap();
    jpeg[frame + 5..frame + 9].copy_from_slice(&[0xff, 0xff, 0xff, 0xff]);
    assert!(!loads(jpeg));
    // Data and display windows of an EXR.
    for attribute in ["dataWindow", "displayWindow"] {
        for side in [32768u32, 30000, 2_000_000_000] {
            let mut exr = sample("a.exr");
            let name = [attribute.as_bytes(), b"\0box2i\0"].concat();
            let at = exr.windows(name.len()).position(|w| w == name).unwrap() + name.len() + 4;
            exr[at + 8..at + 12].copy_from_slice(&(side - 1).to_le_bytes());
            exr[at + 12..at + 16].copy_from_slice(&(side - 1).to_le_bytes());
            assert!(!loads(exr), "{attribute} {side}");
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(600))]
    #[test]
    fn damaged_bytes_never_panic(
        sample in 0usize..1000,
        flips in prop::collection::vec((0.0f64..1.0, any::<u8>()), 1..4),
        cut in prop::option::of(0.0f64..1.0),
    ) {
        let (_, bytes, _) = &SAMPLES[sample % SAMPLES.len()];
        let mut bytes = bytes.clone();
        for (at, value) in flips {
            let at = (at * bytes.len() as f64) as usize;
            bytes[at] = value;
        }
        if let Some(cut) = cut {
            bytes.truncate((cut * bytes.len() as f64) as usize);
        }
        loads(bytes);
    }
}
