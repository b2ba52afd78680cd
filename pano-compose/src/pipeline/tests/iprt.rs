//! iprt, through the pipeline.

use super::*;

/// A floor 1.5 m below the capture point, as deep as the room is wide.
fn floor_depth() -> Image<f32> {
    Image::from_fn(64, 32, |x, y| {
        let d = direction(64, 32, x, y);
        if d.y < -0.3 { -1.5 / d.y } else { 5.0 }
    })
}

const IPRT: &str = "method = 'iprt'\n[view]\nkind = 'perspective'\npitch = -35\nvfov = 50\nsize = [40, 30]\n";

/// `place.scene` puts its last argument behind `[render]`.
fn iprt_scene(place: &Place, object: &str) -> Scene {
    place.exr("room.exr", &smooth_picture());
    place.depth("depth.exr", &floor_depth());
    place.scene("color = 'room.exr'\ndepth = 'depth.exr'\nposition = [0, 1.5, 0]\nfps = 10", &format!("{IPRT}{object}"))
}

/// iprt and dpt agree on what an object looks like and takes away, and iprt says what it took the surfaces to receive.
#[test]
fn iprt_agrees_with_dpt() {
    let place = Place::new();
    let mut scene = iprt_scene(&place, OBJECT);
    scene.render.samples = 256;
    let iprt = run(&scene);
    scene.render.method = Method::Dpt;
    let dpt = run(&scene);
    let sum = |image: &RadianceImage| image.data().iter().map(|p| f64::from(p.y)).sum::<f64>();
    let (object, delta) = (sum(&iprt.layers.object) / sum(&dpt.layers.object), sum(&iprt.layers.delta) / sum(&dpt.layers.delta));
    // The updated panorama knows the change where the view sees it, dpt everywhere; reflectance is read off another map.
    assert!((object - 1.0).abs() < 0.05 && (delta - 1.0).abs() < 0.2, "object {object}, delta {delta}");
    assert!(dpt.irradiance.is_none() && iprt.irradiance.is_some());
    write_output(&place.path("out.exr"), &iprt).unwrap();
    let back = io::read_exr(place.path("out.exr")).unwrap();
    let (real, mixed) = (back.rgb("irradiance_real").unwrap(), back.rgb("irradiance_mixed").unwrap());
    assert!(sum(&real) > sum(&mixed) && sum(&mixed) > 0.5 * sum(&real));
}

#[test]
fn iprt_without_depth_is_refused_and_without_objects_changes_nothing() {
    let place = Place::new();
    let scene = iprt_scene(&place, "");
    let rendered = run(&scene);
    assert!(rendered.composite.multiplier.data().iter().all(|m| *m == Vec3::ONE));
    let flat = place.scene("color = 'room.exr'", &format!("{IPRT}{OBJECT}"));
    fails(&flat, &RenderOptions::default(), &["iprt", "depth", "dpt"]);
}

/// Over frames of one sample the picture gets smoother; a lost frame starts anew, and so does another shot.
#[test]
fn iprt_sequences_remember_until_a_frame_is_lost() {
    let place = Place::new();
    let mut scene = iprt_scene(&place, OBJECT);
    scene.render.samples = 1;
    let options = RenderOptions { denoise: false, ..RenderOptions::default() };
    scene.render.samples = 1024;
    let truth = render(&scene, &options, &Silent).unwrap();
    scene.render.samples = 1;
    let mut sequence = Sequence::new(&scene, &options);
    let mut error = |frame: u32| {
        let rendered = sequence.render(frame, &Silent).unwrap();
        let squares = rendered.composite.color.data().iter().zip(truth.composite.color.data());
        let sparse = rendered.stats.stages.iter().any(|s| s.name == "sparse mask");
        (squares.map(|(a, b)| f64::from(a.distance_squared(*b))).sum::<f64>().sqrt(), sparse)
    };
    let (first, sparse) = error(0);
    assert!(!sparse, "the first frame has no past");
    for frame in 1..12 {
        error(frame);
    }
    let (later, sparse) = error(12);
    assert!(sparse && later < 0.6 * first, "{first} {later}");
    let (lost, sparse) = error(14);
    assert!(!sparse && lost > 1.3 * later, "{later} {lost}");
}
