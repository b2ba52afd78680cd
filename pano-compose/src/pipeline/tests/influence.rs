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
    let object = OBJECT.replace("position = [0, 0, -2]", "position = [0, 0, -3]");
    let mut scene = place.scene(
        &format!("color = 'room.exr'\n{real}\nposition = [0, 1.5, 0]"),
        &format!("{object}[view]\nkind = 'perspective'\npitch = -30\nvfov = 90\nsize = [64, 48]\n"),
    );
    (scene.render.samples, scene.render.bounces, scene.render.method) = (64, bounces, Method::Dpt);
    scene
}

/// 1 below the horizon, 0 above.
fn below(x: usize, y: usize) -> f32 {
    f32::from(u8::from(direction(64, 32, x, y).y < 0.0))
}

/// Rays of the planned run as a share of those of the forced one: measured, with room for other random numbers.
#[test]
fn a_small_object_costs_a_fraction_of_the_forced_run() {
    let place = Place::new();
    for (depth, bounces, most) in [(false, 1, 0.05), (false, 3, 0.05), (true, 1, 0.05), (true, 3, 0.1)] {
        let scene = small_object(&place, depth, bounces);
        let planned = run(&scene);
        let mut options = RenderOptions::default();
        options.settings.captured.irradiance_width = 64;
        options.force("influence", false).unwrap();
        let forced = render(&scene, &options, &Silent).unwrap();
        let share = rays(&planned) as f64 / rays(&forced) as f64;
        let covered = planned.layers.coverage.data().iter().sum::<f32>() / (64.0 * 48.0);
        println!(
            "depth {depth}, {bounces} bounces: covers {covered:.4}, {} of {} rays, {share:.3}",
            rays(&planned),
            rays(&forced)
        );
        assert!((0.005..0.02).contains(&covered), "{covered}");
        assert!(share < most, "depth {depth}, {bounces} bounces: {share}");
        let ratio = change(&planned) / change(&forced);
        assert!((ratio - 1.0).abs() < 0.1, "depth {depth}, {bounces} bounces: {ratio}");
    }
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
    for effect in FORCEABLE {
        options.force(effect, effect != "influence").unwrap();
    }
    let forced = render(&scene, &options, &Silent).unwrap();
    let ratio = change(&planned) / change(&forced);
    assert!((ratio - 1.0).abs() < 0.1, "{ratio}");
    let object = |r: &Rendered| r.layers.object.data().iter().map(|d| f64::from(d.y)).sum::<f64>();
    // Forced bounces add what the faces of a convex thing do not send to one another: nothing.
    assert!((object(&planned) / object(&forced) - 1.0).abs() < 0.05, "{} {}", object(&planned), object(&forced));
}
