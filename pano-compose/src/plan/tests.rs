use super::*;
use glam::Vec3;
use pano_core::material::Material;
use std::collections::BTreeSet;

/// A path-traced still of one diffuse object in a panorama with depth.
fn still() -> SceneFacts {
    SceneFacts { objects: 1, bounces: 1, has_depth: true, method: "dpt".to_owned(), ..SceneFacts::default() }
}

fn on(facts: &SceneFacts) -> Vec<&'static str> {
    EffectPlan::for_scene(facts).effects().iter().filter(|e| e.on).map(|e| e.effect).collect()
}

fn why(facts: &SceneFacts, effect: &str) -> String {
    EffectPlan::for_scene(facts).effects().iter().find(|e| e.effect == effect).unwrap().why.clone()
}

/// Every combination of the facts that rules look at.
fn all_facts() -> impl Iterator<Item = SceneFacts> {
    let methods = ["iprt", "dpt", "mr360", "rt2ar", "ibl", "onepass", "twopass"];
    (0..1u32 << 9).flat_map(move |bits| {
        let bit = move |i: u32| bits >> i & 1 == 1;
        methods.map(|method| SceneFacts {
            objects: usize::from(bit(0)),
            glossy: bit(1),
            transmission: bit(2),
            bounces: 1 + 2 * u32::from(bit(3)),
            has_depth: bit(4),
            has_proxies: bit(5),
            no_back_faces: bit(8),
            no_sparse: bit(3),
            lens: bit(8),
            is_sequence: bit(6),
            moving: bit(7),
            lights: ["mr360", "rt2ar"].contains(&method).then_some(usize::from(bit(3))),
            method: method.to_owned(),
        })
    })
}

#[test]
fn every_effect_is_listed_once_with_a_reason() {
    assert_eq!(EFFECTS.iter().collect::<BTreeSet<_>>().len(), EFFECTS.len());
    for facts in all_facts() {
        let plan = EffectPlan::for_scene(&facts);
        assert!(plan.effects().iter().map(|e| e.effect).eq(EFFECTS), "{facts:?}");
        for effect in plan.effects() {
            assert!(effect.why.len() > 10 && !effect.why.ends_with('.'), "{facts:?}: {effect:?}");
            assert_ne!(effect.why, "unknown effect", "{}", effect.effect);
            assert_eq!(plan.is_on(effect.effect), effect.on);
        }
    }
}

#[test]
fn without_objects_everything_is_off() {
    for facts in all_facts().filter(|f| f.objects == 0) {
        assert_eq!(on(&facts), [""; 0], "{facts:?}");
        assert!(why(&facts, "glossy").contains("no objects"));
    }
}

#[test]
fn lens_effects_are_on_only_if_asked_for() {
    for facts in all_facts() {
        assert_eq!(EffectPlan::for_scene(&facts).is_on("lens"), facts.lens && facts.objects > 0, "{facts:?}");
    }
    assert!(why(&still(), "lens").contains("--set bloom"), "{}", why(&still(), "lens"));
}

#[test]
fn a_diffuse_object_needs_shadows_and_influence_only() {
    assert_eq!(on(&still()), ["light_shadows", "back_faces", "influence"]);
    assert!(why(&still(), "glossy").contains("diffuse"));
    assert!(why(&still(), "transmission").contains("no material"));
    assert!(why(&still(), "multi_bounce").contains("bounces is 1"));
    assert!(why(&still(), "ambient_occlusion").contains("dpt samples every direction"));
    assert!(why(&still(), "temporal").contains("dpt traces every frame by itself"));
}

#[test]
fn sequences_by_iprt_are_sparse_and_remember() {
    let iprt = SceneFacts { method: "iprt".to_owned(), ..still() };
    for effect in ["sparse", "temporal"] {
        assert!(!on(&iprt).contains(&effect) && why(&iprt, effect).contains("still"), "{effect}");
        for sequence in [SceneFacts { is_sequence: true, ..iprt.clone() }, SceneFacts { moving: true, ..iprt.clone() }] {
            assert!(on(&sequence).contains(&effect), "{effect}");
        }
    }
    let dense = SceneFacts { is_sequence: true, no_sparse: true, ..iprt };
    assert!(!on(&dense).contains(&"sparse") && why(&dense, "sparse").contains("switched off"));
}

#[test]
fn each_fact_turns_its_effect_on() {
    assert!(on(&SceneFacts { glossy: true, ..still() }).contains(&"glossy"));
    assert!(on(&SceneFacts { transmission: true, ..still() }).contains(&"transmission"));
    assert!(on(&SceneFacts { bounces: 3, ..still() }).contains(&"multi_bounce"));
    assert!(why(&SceneFacts { bounces: 3, ..still() }, "multi_bounce").contains("bounces is 3"));
}

#[test]
fn shadows_and_influence_need_a_real_surface() {
    let floating = SceneFacts { has_depth: false, ..still() };
    assert_eq!(on(&floating), [""; 0]);
    assert!(why(&floating, "light_shadows").contains("no depth, no proxy"));
    assert!(why(&floating, "back_faces").contains("no depth"));
    let switched = SceneFacts { no_back_faces: true, ..still() };
    assert!(!on(&switched).contains(&"back_faces") && why(&switched, "back_faces").contains("switched off"));
    let on_ground = SceneFacts { has_proxies: true, ..floating };
    assert_eq!(on(&on_ground), ["light_shadows", "influence"]);
    assert!(why(&on_ground, "light_shadows").contains("proxy or a ground plane"));
    assert!(why(&still(), "light_shadows").contains("depth"));
    let other = SceneFacts { method: "onepass".to_owned(), ..still() };
    assert!(!on(&other).contains(&"influence") && why(&other, "influence").contains("onepass renders every pixel"));
}

#[test]
fn mr360_casts_shadows_of_lights_that_stand_out() {
    let mr360 = |lights| SceneFacts { has_depth: false, has_proxies: true, method: "mr360".to_owned(), lights, ..still() };
    assert_eq!(on(&mr360(Some(2))), ["light_shadows", "ambient_occlusion"]);
    assert!(why(&mr360(Some(2)), "light_shadows").contains("2 of"));
    assert_eq!(on(&mr360(Some(0))), ["ambient_occlusion"]);
    assert!(why(&mr360(Some(0)), "light_shadows").contains("no light stands out"));
    let bounces = SceneFacts { bounces: 3, ..mr360(Some(1)) };
    assert!(!on(&bounces).contains(&"multi_bounce") && why(&bounces, "multi_bounce").contains("mr360"));
    // Only methods that look for lights are judged by them.
    assert!(on(&SceneFacts { lights: Some(0), ..still() }).contains(&"light_shadows"));
}

#[test]
fn image_based_lighting_blocks_and_changes_nothing() {
    let ibl = SceneFacts { method: "ibl".to_owned(), glossy: true, bounces: 3, has_proxies: true, ..still() };
    assert_eq!(on(&ibl), ["glossy"]);
    assert!(why(&ibl, "light_shadows").contains("blocks no light"));
    assert!(why(&ibl, "ambient_occlusion").contains("blocks no light"));
    assert!(why(&ibl, "multi_bounce").contains("once"));
    assert!(why(&ibl, "influence").contains("nothing real"));
}

#[test]
fn materials_are_judged_as_the_tracer_shades_them() {
    let glossy = [
        (Material::diffuse(Vec3::ONE), false),
        (Material::emitter(Vec3::ONE), false),
        (Material::metal(Vec3::ONE, 1.0), true),
        // The default is rough plastic: its coat is wide, but there.
        (Material::default(), true),
        (Material { ior: 1.0, ..Material::default() }, false),
        (Material { specular_color: Vec3::ZERO, ..Material::default() }, false),
        (Material::glass(1.5, 0.0), true),
    ];
    for (material, expected) in glossy {
        assert_eq!(is_glossy(&material), expected, "{material:?}");
    }
    assert!(is_transmissive(&Material::glass(1.5, 0.0)));
    assert!(!is_transmissive(&Material { metallic: 1.0, ..Material::glass(1.5, 0.0) }));
    let mut facts = still();
    facts.note_material(&Material::glass(1.5, 0.2));
    facts.note_material(&Material::diffuse(Vec3::ONE));
    assert_eq!((facts.glossy, facts.transmission), (true, true));
}

#[cfg(feature = "pipeline")]
#[test]
fn the_plan_serialises_as_a_list_of_effect_on_why() {
    let json = serde_json::to_value(EffectPlan::for_scene(&still())).unwrap();
    let list = json.as_array().unwrap();
    assert_eq!(list.len(), EFFECTS.len());
    assert_eq!(list[0]["effect"], "glossy");
    assert_eq!(list[0]["on"], false);
    assert!(list[0]["why"].is_string() && list[0].as_object().unwrap().len() == 3);
}
