// What a marched ray means: the surface it met, its light, and the density with which light samples find it; see
// world/captured/mod.rs and hidden.rs. A back face is lit by more rays, which the kernels answer in turn before the ray itself.

// Where a ray goes through the panorama's frame, and how it is to be followed.
struct Way {
    origin: vec3f,
    t_max: f32,
    direction: vec3f,
    by: u32,
}

const NOT_FOLLOWED: u32 = 0u;
const MARCHED: u32 = 1u;
// It is the panorama's own view.
const LOOKED: u32 = 2u;

fn way_of(world: World, origin: vec3f, direction: vec3f, t_max: f32) -> Way {
    let place = place_in_pano(world, origin);
    let by = select(MARCHED, LOOKED, dot(place, place) < AT_CAPTURE * AT_CAPTURE);
    return Way(place, t_max, to_pano(world, direction), by);
}

// What lies on a way, in the panorama's frame.
struct Found {
    exists: bool,
    hidden: bool,
    t: f32,
    at: vec3f,
    normal: vec3f,
    // The normal just there, by which densities go.
    facet: vec3f,
    // What it sends back, or infinity does.
    radiance: vec3f,
    // What the panorama shows of its front.
    front: Seen,
}

// Radiance shown along `d`; across a gap the nearest texel's.
fn shown(world: World, d: vec3f, at_gap: bool) -> vec3f {
    let uv = uv_from_direction(d);
    if !at_gap {
        return picture_at(0u, world.size, uv);
    }
    let at = footprint(vec2i(world.size), uv);
    let nearest = at.texel + select(vec2i(0), vec2i(1), at.fraction >= vec2f(0.5));
    return texel_at(0u, world.size, wrap_texel(vec2i(world.size), nearest.x, nearest.y));
}

// Radiance that infinity shows along `d`.
fn beyond(world: World, d: vec3f) -> vec3f {
    let size = vec2i(world.size);
    let at = footprint(size, uv_from_direction(d));
    var sum = vec3f(0.0);
    for (var i = 0; i < 4; i++) {
        let tap = tap_of(size, at, i);
        var texel = tap.texel;
        if world.infinity != NO_INFINITY {
            let shows = i32(word(world.infinity + u32(texel.y * size.x + texel.x)));
            texel = vec2i(shows % size.x, shows / size.x);
        }
        sum += texel_at(0u, world.size, texel) * tap.weight;
    }
    return sum;
}

// What the panorama itself sees along `d`.
fn found_by_look(seen: Seen, d: vec3f, t_max: f32) -> Found {
    var found: Found;
    let inverse = 1.0 / sqrt(dot(seen.plane, seen.plane));
    found.t = 1.0 / seen.inverse;
    found.exists = seen.inverse > 0.0 && is_finite(inverse) && inverse > 0.0 && found.t < t_max;
    found.at = d / seen.inverse;
    found.normal = seen.plane * -inverse;
    found.facet = found.normal;
    found.front = seen;
    return found;
}

fn found_on(world: World, way: Way, met: Met) -> Found {
    var toward = way.direction;
    let marched = way.by == MARCHED;
    let hits = marched && met.what != LEFT && met.what != OUT_OF_STEPS;
    let hidden = hits && met.what != SURFACE;
    if hits {
        toward = select(way.origin + way.direction * met.t, met.shown, hidden);
    }
    var seen: Seen;
    if !marched || (hits && met.what != BACK_LAYER) {
        seen = look(toward);
    }
    var found: Found;
    if marched {
        found = Found(hits, hidden, met.t, way.origin + way.direction * met.t, met.normal, met.normal, vec3f(0.0), seen);
        if met.what == SURFACE {
            found.normal = smoothed(seen.plane, way.direction, Side(met.normal, met.back == 1u, true));
        }
    } else {
        found = found_by_look(seen, way.direction, way.t_max);
    }
    if found.exists {
        found.radiance = shown(world, toward, hits && met.at_gap == 1u);
    } else {
        found.radiance = beyond(world, way.direction);
    }
    return found;
}

// See CapturedWorld::shown_surface.
fn shown_surface(world: World, found: Found, direction: vec3f, pick: f32) -> Found {
    if dot(found.at, direction) < 0.9999 * length(found.at) || !near_gap(found.at) {
        return found;
    }
    let size = vec2i(world.size);
    let at = footprint(size, uv_from_direction(found.at));
    var left = pick;
    var texel = vec2i(0);
    for (var i = 0; i < 4; i++) {
        let tap = tap_of(size, at, i);
        texel = tap.texel;
        if left < tap.weight {
            break;
        }
        left -= tap.weight;
    }
    let d = direction_from_uv((vec2f(texel) + 0.5) / vec2f(size));
    var changed = found_by_look(look(d), d, NEVER);
    if !changed.exists {
        // The share of infinity does not change.
        changed = found;
        changed.radiance = vec3f(0.0);
    } else {
        changed.radiance = texel_at(0u, world.size, texel);
    }
    return changed;
}

// Density per steradian at the way's beginning with which a light sample finds its direction; see CapturedWorld::light_pdf.
fn light_pdf(world: World, way: Way, found: Found) -> f32 {
    let lamps = lamp_light(world, way.origin, way.direction);
    var pdf = 0.0;
    if LIT && !found.hidden {
        var d = way.direction;
        var factor = 1.0;
        if found.exists {
            // Density per steradian at the capture point, per area there, per steradian here.
            let r2 = dot(found.at, found.at);
            d = found.at / sqrt(r2);
            factor = found.t * found.t * abs(dot(d, found.facet)) / (r2 * max(abs(dot(way.direction, found.facet)), 1e-6));
        } else if inverse_distance(d) > 0.0 {
            // Only what the panorama sees of infinity is aimed at.
            factor = 0.0;
        }
        pdf = sphere_pdf(light_table(world), d) * factor;
        pdf = select(0.0, pdf, is_finite(pdf));
    }
    return (1.0 - lamps.share) * pdf + lamps.share * lamps.pdf;
}

// Whether a way shows what a light sample was aimed at; `position` is that of what was found.
fn is_reached(world: World, found: Found, position: vec3f, aimed: u32, goal: vec3f) -> bool {
    if aimed != AT_SURFACE {
        return aimed == AT_ANYTHING || !found.exists;
    }
    // The same patch of the surface, up to rounding.
    let tolerance = 1e-3 * (found.t + length(goal - world.capture));
    let off = goal - position;
    return found.exists && !found.hidden && dot(off, off) < tolerance * tolerance;
}

// A back face that is being lit, or a surface that is asked for its mirror image.
struct Relit {
    // Where its rays begin, in the world, and which pair of them is under way.
    start: vec3f,
    pair: u32,
    normal: vec3f,
    // Of the pair: 0 by the cosine, 1 towards light.
    second: u32,
    // What it sends out in any light, and what it makes of a pair's.
    own: vec3f,
    aimed: u32,
    scale: vec3f,
    // What it is to count, if a mirror shows it.
    gloss: f32,
    received: vec3f,
    // …and at most.
    most: f32,
    goal: vec3f,
    pad2: u32,
    position: vec3f,
    pad3: u32,
    // What a surface that objects have `changed` showed without them.
    before: vec3f,
    changed: u32,
}

// A back face at `position`, made of what `found` shows of its front; see CapturedWorld::relit.
fn relit_of(world: World, found: Found, position: vec3f, normal: vec3f, front: Found) -> Relit {
    var relit: Relit;
    let shown_ = found.radiance;
    let received = irradiance_at(world, front.at, front.normal);
    let reflectance = reflectance_from(shown_, received, world.cap);
    let white = received / PI;
    relit.position = position;
    relit.start = world_leave(world, RealHit(position, 0.0, normal, HIDDEN_SIDE, vec3f(0.0), true));
    relit.normal = normal;
    relit.own = max(min(shown_, white) - reflectance * white, vec3f(0.0)) + max(shown_ - white, vec3f(0.0)) * GLOW;
    relit.scale = reflectance / PI;
    if world.hidden_samples == 0u {
        relit.own += reflectance * white;
    }
    return relit;
}

// The cell of a place relative to the capture point, all of which draws the same random numbers; see hidden::cell_around.
fn cell_around(place: vec3f) -> vec3u {
    let exponent = clamp(bitcast<u32>(length(place)) >> 23u, 64u, 190u);
    let scale = bitcast<f32>((254u + CELL_BITS - exponent) << 23u);
    return bitcast<vec3u>(vec3i(floor(place * scale)));
}

// The next ray that lights it; not followed if there is none. Its place draws the random numbers.
fn next_way(world: World, relit: ptr<function, Relit>) -> Way {
    while (*relit).pair < world.hidden_samples {
        let cell = cell_around((*relit).position - world.capture);
        var numbers = sampler_of(cell.xy, (*relit).pair, ~world.seed, cell.z);
        let u = next_4d(&numbers);
        let second = (*relit).second == 1u;
        (*relit).aimed = AT_ANYTHING;
        let disc = concentric_disc(u.xy);
        let normal = (*relit).normal;
        var d = tangent_of(normal) * disc.x + bitangent_of(normal) * disc.y + normal * sqrt(max(1.0 - dot(disc, disc), 0.0));
        var exists = true;
        if second {
            let sample = world_sample_light(world, (*relit).start, u.zw);
            d = sample.direction;
            exists = sample.exists;
            (*relit).aimed = sample.aimed;
            (*relit).goal = sample.goal;
        }
        if exists && dot(d, normal) > 0.0 {
            return way_of(world, (*relit).start, d, NEVER);
        }
        pass_on(relit);
    }
    return Way(vec3f(0.0), 0.0, vec3f(0.0), NOT_FOLLOWED);
}

// To the second of a pair, or to the next one.
fn pass_on(relit: ptr<function, Relit>) {
    (*relit).pair += (*relit).second;
    (*relit).second = 1u - (*relit).second;
}

// Adds what one of its rays has found.
fn receive(world: World, relit: ptr<function, Relit>, way: Way, found: Found, pdf: f32) {
    let direction = from_pano(world, way.direction);
    let cosine = dot(direction, (*relit).normal);
    if is_reached(world, found, (*relit).start + direction * found.t, (*relit).aimed, (*relit).goal) {
        (*relit).received += found.radiance * (cosine / (cosine / PI + pdf));
    }
    pass_on(relit);
}

