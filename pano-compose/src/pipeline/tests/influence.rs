//! Only what a scene calls for is done: stages that are off are not there, pixels that nothing changes cost next to nothing.

use super::*;

fn rays(rendered: &Rendered) -> u64 {
    rendered.stats.stages.iter().map(|s| s.rays).sum()
}

/// Sum of the change.
fn change(rendered: &Rendered) -> f64 {
    rendered.layers.delta.data().iter().map(|d| f64::from(d.y)).sum()
}

/// A floor with a thing on it that covers 1 % of the view, in a panorama with depth or on a ground.
fn small_object(place: &Place, depth: bool, bounces: u32) -> Scene {
    place.exr("room.exr", &smooth_picture());
    // A horizontal floor; above it nothing.
    place
        .depth("depth.exr", &Image::from_fn(64, 32, |x, y| (-1.5 / direction(64, 32, x, y).y.min(-0.05)).max(0.0) * below(x, y)));
    let real = if depth { "depth = 'depth.exr'" } else { "camera_height = 1.5" };
    let object = OBJECT.replace("position = [0, 0, -2]", "position = [0, 0, -2.1]");
    let mut scene = place.scene(
        &format!("color = 'room.exr'\n{real}\nposition = [0, 1.5, 0]"),
        &format!("{object}[view]\nkind = 'perspective'\npitch = -30\nvfov = 90\nsize = [192, 144]\n"),
    );
    (scene.render.samples, scene.render.bounces, scene.render.method) = (64, bounces, Method::Dpt);
    scene
}

/// 1 below the horizon, 0 above.
fn below(x: usize, y: usize) -> f32 {
    f32::from(u8::from(direction(64, 32, x, y).y < 0.0))
}

/// Rays of the planned run as a share of those of the forced one. Every point of an open floor sees the object, and a low sun
/// behind it may change any of them, so that each is asked by a sample at least.
#[test]
fn a_small_object_costs_a_fraction_of_the_forced_run() {
    let place = Place::new();
    let mut failures = Vec::new();
    for (depth, bounces) in [(false, 1), (false, 3), (true, 1), (true, 3)] {
        let scene = small_object(&place, depth, bounces);
        let planned = run(&scene);
        let mut options = RenderOptions::default();
        options.settings.captured.irradiance_width = 64;
        options.force("influence", false).unwrap();
        let forced = render(&scene, &options, &Silent).unwrap();
        let share = rays(&planned) as f64 / rays(&forced) as f64;
        let covered = planned.layers.coverage.data().iter().sum::<f32>() / (192.0 * 144.0);
        println!(
            "depth {depth}, {bounces} bounces: covers {covered:.4}, {} of {} rays, {share:.3}",
            rays(&planned),
            rays(&forced)
        );
        let ratio = change(&planned) / change(&forced);
        if !((0.005..0.02).contains(&covered) && share < 0.05 && (ratio - 1.0).abs() < 0.1) {
            failures.push(format!("depth {depth}, {bounces} bounces: covers {covered}, share {share}, change {ratio}"));
        }
    }
    assert!(failures.is_empty(), "{failures:?}");
}

/// Where the object is below the horizon of all there is, one sample in 64 looks, and the photo comes back bit for bit.
#[test]
fn what_sees_no_object_costs_next_to_nothing() {
    let place = Place::new();
    let mut scene = small_object(&place, false, 1);
    scene.objects[0].placement.position.y = -2.0;
    let planned = run(&scene);
    let mut options = RenderOptions::default();
    options.force("influence", false).unwrap();
    let forced = render(&scene, &options, &Silent).unwrap();
    assert!(rays(&planned) as f64 / (rays(&forced) as f64) < 0.02, "{} of {} rays", rays(&planned), rays(&forced));
    assert!(bits(&planned.composite.color) == bits(&planned.photo), "the photo has changed");
}

/// The stages of a matt object under direct light, and no others; nothing of gloss, glass, back faces or lights.
#[test]
fn a_matt_scene_runs_no_stage_it_does_not_call_for() {
    let place = Place::new();
    let scene = small_object(&place, false, 1);
    let planned = run(&scene);
    let stages: Vec<&str> = planned.stats.stages.iter().map(|s| s.name).collect();
    assert_eq!(stages, ["load", "world", "view", "trace", "denoise", "composite"]);
    for effect in ["glossy", "transmission", "multi_bounce", "back_faces", "sparse", "temporal", "lens", "ambient_occlusion"] {
        assert!(!planned.stats.plan.is_on(effect), "{effect}");
    }
    let mut options = RenderOptions::default();
    // Not a second bounce, which is other light.
    for effect in FORCEABLE.into_iter().filter(|effect| *effect != "multi_bounce") {
        options.force(effect, effect != "influence").unwrap();
    }
    let forced = render(&scene, &options, &Silent).unwrap();
    let ratio = change(&planned) / change(&forced);
    assert!((ratio - 1.0).abs() < 0.1, "{ratio}");
    let object = |r: &Rendered| r.layers.object.data().iter().map(|d| f64::from(d.y)).sum::<f64>();
    assert!((object(&planned) / object(&forced) - 1.0).abs() < 0.05, "{} {}", object(&planned), object(&forced));
}
