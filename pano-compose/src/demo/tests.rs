//! Tests.
use super::*;
#[test]
fn try_capture() {
    let var = |n: &str, d: u32| std::env::var(n).ok().and_then(|v| v.parse().ok()).unwrap_or(d);
    let place = Place::new().unwrap();
    let (empty, full) = (place.without_objects(), place.with_objects());
    let q = |s, f: u32| Quality {
        samples: s,
        coarsest: if f == 1 { 8 } else { 4 },
        bounces: 5,
        streams: [2 * f, 2 * f + 1].map(|frame: u32| Stream { frame, seed: 0 }),
    };
    let t = Instant::now();
    let p = place.panorama(var("PW", 1024) as usize);
    let r = reference::trace(&empty, &p, &q(var("PS", 12), 1), &pano_core::progress::Silent).unwrap();
    println!("pano {:?} rays {} cut {}", t.elapsed(), r.rays, r.lost_light);
    let v = place.view((480, 360));
    let t = Instant::now();
    let tr = reference::trace(&full, &v, &q(var("TS", 32), 2), &pano_core::progress::Silent).unwrap();
    println!("truth {:?} rays {} cut {}", t.elapsed(), tr.rays, tr.lost_light);
    let mut raw = place.view((480, 360));
    raw.position += glam::Vec3::ZERO;
    for (name, px) in
        [("table", (250, 250)), ("head", (152, 130)), ("shadow", (372, 240)), ("wall", (40, 40)), ("sofa", (280, 60))]
    {
        println!("truth {name} {}", tr.radiance.get(px.0, px.1));
    }
    let mut photo = RadianceImage::filled(480, 360, glam::Vec3::ZERO);
    pano_core::sphere::resample::view_from_panorama(&r.radiance, glam::Quat::IDENTITY, &v, &mut photo).unwrap();
    let w = 0.945;
    for (n, i) in [("pano", &r.radiance), ("truth", &tr.radiance), ("photo", &photo)] {
        pano_core::io::write_image(format!("/tmp/t_{n}.png"), &numbers::exposed(i, w), None).unwrap();
    }
}
