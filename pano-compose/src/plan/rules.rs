//! The rule of each effect.

use super::SceneFacts;

/// Whether `effect` takes part, and why.
pub(super) fn decide(effect: &str, facts: &SceneFacts) -> (bool, String) {
    if facts.objects == 0 {
        return off("the scene has no objects");
    }
    match effect {
        "glossy" if facts.glossy => on("a material has a specular lobe (metallic or specular above 0)"),
        "glossy" => off("every material is purely diffuse"),
        "transmission" if facts.transmission => on("a material has transmission above 0"),
        "transmission" => off("no material lets light through"),
        "multi_bounce" if is_ibl(facts) => off("ibl scatters light once, whatever the number of bounces"),
        "multi_bounce" if is_mr360(facts) => off("mr360 looks light up by direction; only mirrors and glass are followed"),
        "multi_bounce" if is_rt2ar(facts) && facts.bounces > 1 => {
            on(&format!("bounces is {}: so many reflections and refractions are followed one after the other", facts.bounces))
        }
        "multi_bounce" if facts.bounces > 1 => {
            on(&format!("bounces is {}: light may scatter more than once after the camera", facts.bounces))
        }
        "multi_bounce" => off(&format!("bounces is {}: direct light only", facts.bounces)),
        "light_shadows" if is_ibl(facts) => off("ibl blocks no light and changes nothing real"),
        "light_shadows" if has_lights(facts) && facts.lights == Some(0) => {
            off("no light stands out of the panorama, so that nothing casts a shadow of its own")
        }
        "light_shadows" if has_lights(facts) => match facts.lights {
            Some(n) => on(&format!("{n} of the panorama's lights stand out: objects block them")),
            None => on("objects block the lights that stand out of the panorama"),
        },
        "light_shadows" if facts.has_receivers() => {
            let receiver = if facts.has_depth { "the panorama has depth" } else { "there is a proxy or a ground plane" };
            on(&format!("{receiver}: objects block light from real surfaces"))
        }
        "light_shadows" => off("nothing real can receive a shadow: no depth, no proxy, no ground plane"),
        "ambient_occlusion" if is_ibl(facts) => off("ibl blocks no light"),
        "ambient_occlusion" if is_mr360(facts) => on("the maps know no objects: rays find what is in the way of their light"),
        "ambient_occlusion" if is_path_traced(facts) => {
            off(&format!("{} samples every direction, which includes occlusion", facts.method))
        }
        "ambient_occlusion" => off("rt2ar shadows the lights only, as its paper does"),
        "back_faces" if !facts.has_depth => off("the panorama has no depth, so it has no depth gaps to guess behind"),
        "back_faces" if is_ibl(facts) => off("ibl looks at infinity only"),
        "back_faces" if facts.no_back_faces => off("switched off: rays that pass behind a depth gap go on to the next layer"),
        "back_faces" => on("the panorama has depth: what it could not see of things gets a back face that mirrors the front"),
        "sparse" | "temporal" if facts.method != "iprt" => {
            off(&format!("{} traces every frame by itself; iprt does not", facts.method))
        }
        "sparse" if !facts.is_sequence && !facts.moving => off("a still has no earlier frames to tell where nothing changes"),
        "sparse" if facts.no_sparse => off("switched off: every pixel of every frame is traced"),
        "sparse" => on("from the second frame on, flat places whose light no object touches are traced at one pixel in 4 or 16"),
        "temporal" if !facts.is_sequence && !facts.moving => off("a still has no earlier frames"),
        "temporal" => on("every frame is blended with the one before along the motion of its points"),
        "lens" if facts.lens => on("asked for: bright light that the objects add is spread as by a lens"),
        "lens" => off("not asked for: the photo went through a lens already (--set bloom=0.1, --set glare=0.1)"),
        "influence" if is_ibl(facts) => off("ibl changes nothing real"),
        "influence" if !facts.has_receivers() => off("no real surface is known that the objects could change"),
        "influence" if facts.method == "dpt" => on("pixels take samples by how much the objects can change them"),
        "influence" => off(&format!("{} renders every pixel; only dpt skips those that no object can change", facts.method)),
        // Unreachable for the names in `EFFECTS`; a test decides all of them.
        _ => off("unknown effect"),
    }
}

/// Whether the method integrates over all directions, so that occlusion is no effect of its own.
fn is_path_traced(facts: &SceneFacts) -> bool {
    matches!(facts.method.as_str(), "dpt" | "onepass" | "twopass" | "iprt")
}

/// Lookups in convolved maps, and rays for lights and occlusion.
fn is_mr360(facts: &SceneFacts) -> bool {
    facts.method == "mr360"
}

/// Recursive rays.
fn is_rt2ar(facts: &SceneFacts) -> bool {
    facts.method == "rt2ar"
}

/// The method looks for the lights that stand out of the panorama.
fn has_lights(facts: &SceneFacts) -> bool {
    is_mr360(facts) || is_rt2ar(facts)
}

/// Image-based lighting without visibility, the baseline.
fn is_ibl(facts: &SceneFacts) -> bool {
    facts.method == "ibl"
}

fn on(why: &str) -> (bool, String) {
    (true, why.to_owned())
}

fn off(why: &str) -> (bool, String) {
    (false, why.to_owned())
}
