// What the centres of the view's pixels see, where that was in an earlier view, and how much of a pixel shows objects; see
// iprt/gbuffer.rs and iprt/motion.rs.

struct Texel {
    normal: vec3f,
    // Negative where nothing is.
    depth: f32,
    position: vec3f,
    thing: u32,
    albedo: vec3f,
    // 1 if it is perfectly smooth.
    mirrors: u32,
    // In pixels of the earlier view; `known` is 1 if it is anywhere.
    previous: vec2f,
    known: u32,
    previous_depth: f32,
}

@group(0) @binding(17) var<storage, read_write> texels: array<Texel>;
// Points of each pixel that were asked for, and those that show an object.
@group(0) @binding(18) var<storage, read_write> covers: array<vec2u>;

// Where a point was, of the thing that a texel shows; see Objects::was_at.
struct Before {
    position: vec3f,
    known: bool,
}

fn was_at(thing: u32, position: vec3f) -> Before {
    if thing == 0u {
        return Before(position, true);
    }
    let at = params.moves + MOVE_WORDS * (thing - 1u);
    return Before(matrix_at(at) * position + vec3_at(at + 9u), word(at + 12u) == 1u);
}

@compute @workgroup_size(8, 8)
fn gbuffer(@builtin(global_invocation_id) id: vec3u) {
    if !is_held(params.rows, id) {
        return;
    }
    let at = texel_of(params.rows, id);
    let k = index_of(params.rows, at);
    let answer = answer_of(k);
    let direction = asked[k].quest.direction;
    var texel: Texel;
    texel.depth = -1.0;
    if answer.real.exists {
        texel.depth = answer.real.t;
        texel.normal = answer.real.normal;
        texel.position = answer.real.position;
    } else if answer.object.instance != NOTHING {
        let surface = surface_at(objects(), answer.object, direction);
        let bsdf = bsdf_at(surface.material, surface.geometric, surface.normal, -direction);
        texel.depth = answer.object.t;
        texel.normal = bsdf.normal;
        texel.position = surface.position;
        texel.albedo = surface.material.base_color;
        texel.mirrors = select(0u, 1u, bsdf_is_specular(bsdf));
        texel.thing = answer.object.instance + 1u;
    }
    if params.has_earlier == 1u {
        // What has no depth lies in a direction.
        var seen = camera_direction(vec2f(at) + 0.5);
        var known = true;
        if texel.depth >= 0.0 {
            let before = was_at(texel.thing, texel.position);
            seen = before.position - params.earlier.position;
            known = before.known;
            texel.previous_depth = select(0.0, length(seen), known);
        }
        let there = view_pixel(params.earlier, vec2f(size_of(params.rows)), seen);
        texel.previous = there.at;
        texel.known = select(0u, 1u, known && there.exists);
    }
    texels[k] = texel;
}

// The answer about a point of each pixel whose coverage is measured, and the next one's ray.
@compute @workgroup_size(8, 8)
fn cover(@builtin(global_invocation_id) id: vec3u) {
    if !is_held(params.rows, id) {
        return;
    }
    let at = texel_of(params.rows, id);
    let k = index_of(params.rows, at);
    let number = covers[k].x;
    if number > COVER_POINTS {
        asked[k].quest.asks = 0u;
        return;
    }
    if number > 0u {
        if asked[k].quest.asks != 0u {
            return;
        }
        let answer = answer_of(k);
        covers[k].y += select(0u, 1u, answer.object.instance != NOTHING && !answer.real.exists);
    }
    if number < COVER_POINTS {
        let side = u32(sqrt(f32(COVER_POINTS)));
        let point = (vec2f(f32(number % side), f32(number / side)) + 0.5) / f32(side);
        send(CAMERA, params.view.position, camera_direction(vec2f(at) + point));
        ray.asks = ASKS | FOR_OBJECTS | IF_MET;
        asked[k].quest = ray;
    }
    covers[k].x = number + 1u;
}
