//! Adaptive sampling through the whole pipeline.

use super::*;

fn with_target(scene: &Scene, target: &str) -> Rendered {
    let mut options = RenderOptions::default();
    options.settings.set("error_target", target).unwrap();
    render(scene, &options, &Silent).unwrap()
}

/// The error map is written and its mean told; a target twice as large takes fewer samples; off, nothing of it is there.
#[test]
fn the_error_map_is_written_where_it_was_asked_for() {
    let place = Place::new();
    place.exr("room.exr", &smooth_picture());
    let view = "[view]\nkind = 'perspective'\npitch = -20\nsize = [24, 18]\n";
    let mut scene = place.scene("color = 'room.exr'\ncamera_height = 1.0", &format!("{OBJECT}{view}"));
    scene.render.samples = 256;
    for method in [Method::Dpt, Method::Onepass, Method::Twopass, Method::Ibl] {
        scene.render.method = method;
        let [coarse, fine] = ["0.04", "0.02"].map(|target| with_target(&scene, target));
        let [few, many] = [&coarse, &fine].map(|r| r.stats.sampling.expect("sampling was adaptive"));
        assert!(16.0 <= few.samples && few.samples < many.samples && many.samples < 256.0, "{method:?}: {few:?}, {many:?}");
        assert!(many.error < few.error && many.error > 0.0, "{method:?}: {few:?}, {many:?}");
        write_output(&place.path("out.exr"), &coarse).unwrap();
        let file = io::read_exr(place.path("out.exr")).unwrap();
        let map = file.get("error.V").expect("the channel error.V");
        assert_eq!(map.size(), (24, 18));
        let mean = map.data().iter().sum::<f32>() / map.data().len() as f32;
        assert!((mean - few.error).abs() < 1e-4 * mean, "{method:?}: {mean} is not {}", few.error);
        let off = with_target(&scene, "off");
        assert!(off.error.is_none() && off.stats.sampling.is_none(), "{method:?}");
    }
    // mr360 and the others take their samples elsewhere.
    scene.render.method = Method::Mr360;
    assert!(with_target(&scene, "0.1").error.is_none());
}

/// Of an LDR panorama the change is brought to the photo's scale, and its error with it.
#[test]
fn the_error_is_on_the_photos_scale() {
    let place = Place::new();
    let picture = smooth_picture();
    io::write_image(place.path("room.png"), &picture, None).unwrap();
    let view = "[view]\nkind = 'perspective'\npitch = -20\nsize = [24, 18]\n";
    let mut scene = place.scene("color = 'room.png'\ncamera_height = 1.0", &format!("{OBJECT}{view}"));
    scene.render.method = Method::Dpt;
    scene.render.samples = 64;
    let rendered = with_target(&scene, "0");
    let error = rendered.error.as_ref().unwrap();
    let mut noisy = 0;
    for (i, (error, delta)) in error.data().iter().zip(rendered.layers.delta.data()).enumerate() {
        if rendered.layers.coverage.data()[i] == 0.0 && *delta != Vec3::ZERO {
            // Noise in the change is no larger than what there is to take away.
            assert!(*error <= rendered.photo.data()[i].max_element(), "{i}: {error} of {}", rendered.photo.data()[i]);
            noisy += 1;
        }
    }
    assert!(noisy > 20, "{noisy} pixels change");
}
