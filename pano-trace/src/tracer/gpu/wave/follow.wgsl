// Rays under way over captured radiance, one an invocation. In one kernel all of it would take a minute to compile; here several take
// turns: `encounter` looks for objects on each ray, `march` follows it through the panorama's depth, `tell` says what that means. A
// shader that includes this says what objects have changed of the panorama (`UPDATES`, `update_at`).

// What a ray met in the real world.
struct Told {
    position: vec3f,
    t: f32,
    normal: vec3f,
    // Bits of LIGHT_KNOWN and the like.
    what: u32,
    // What the surface or infinity shows: its matter is told from that.
    radiance: vec3f,
    pdf: f32,
    // What arrives of it: as objects have changed it, with the mirror image that shows from there, in the light of a back face itself.
    light: vec3f,
    pad: u32,
}

// Beside REAL_EXISTS and REAL_HIDDEN.
const LIGHT_KNOWN: u32 = 4u;
const WORLD_ASKED: u32 = 8u;

// A ray in hand and what is known of it. `quest.asks` is 0 once all is told.
struct Asked {
    quest: Quest,
    object: Hit,
    way: Way,
    met: Met,
    told: Told,
}

// The way is one of those that light a back face, or the one that tells what the surface mirrors.
const RELIGHTS: u32 = 128u;
const MIRRORS: u32 = 256u;

// What is known of a surface's change.
struct Update {
    // The share of its light that objects take: exactly 0 where they take none.
    taken: vec3f,
    // The share of its radiance that leaves in all directions, and the mirror's reflectance.
    scattered: f32,
    mirror: f32,
}

@group(0) @binding(7) var<storage, read_write> asked: array<Asked>;
// The depth field; see prt/gpu/field.wgsl.
@group(0) @binding(10) var<storage, read> inverses: array<f32>;
@group(0) @binding(11) var<storage, read> gaps: array<u32>;
@group(0) @binding(12) var<storage, read> base: array<u32>;
@group(0) @binding(13) var<storage, read> upper: array<u32>;
@group(0) @binding(14) var<storage, read_write> relits: array<Relit>;
// Rays under way in each of some turns.
@group(0) @binding(15) var<storage, read_write> counts: array<atomic<u32>>;

// Objects on each ray, and where it goes in the panorama's frame.
@compute @workgroup_size(8, 8)
fn encounter(@builtin(global_invocation_id) id: vec3u) {
    if !is_held(params.rows, id) {
        return;
    }
    let k = index_of(params.rows, texel_of(params.rows, id));
    let quest = asked[k].quest;
    if quest.asks == 0u {
        return;
    }
    atomicAdd(&counts[params.turn], 1u);
    if (quest.asks & (RELIGHTS | MIRRORS)) != 0u {
        return;
    }
    var object = Hit(quest.limit, 0.0, 0.0, NOTHING, 0u);
    if (quest.asks & FOR_OBJECTS) != 0u {
        object = trace_ray(params.view.roots.x, quest.origin, quest.direction, quest.limit, (quest.asks & FOR_ANY) != 0u);
    }
    asked[k].object = object;
    let up_to = select(object.t, NEVER, (quest.asks & BEHIND_OBJECTS) != 0u);
    var way = way_of(params.world, quest.origin, quest.direction, up_to);
    if !asks_world(quest.asks, object.instance != NOTHING) {
        way.by = NOT_FOLLOWED;
    }
    asked[k].way = way;
}

@compute @workgroup_size(8, 8)
fn march(@builtin(global_invocation_id) id: vec3u) {
    if !is_held(params.rows, id) {
        return;
    }
    let k = index_of(params.rows, texel_of(params.rows, id));
    let way = asked[k].way;
    if asked[k].quest.asks != 0u && way.by == MARCHED {
        asked[k].met = march_ray(Ray(way.origin, way.t_max, way.direction, 0u));
    }
}

@compute @workgroup_size(8, 8)
fn tell(@builtin(global_invocation_id) id: vec3u) {
    if !is_held(params.rows, id) {
        return;
    }
    let k = index_of(params.rows, texel_of(params.rows, id));
    let quest = asked[k].quest;
    if quest.asks == 0u {
        return;
    }
    let world = params.world;
    let way = asked[k].way;
    if way.by == NOT_FOLLOWED {
        asked[k].told.what = 0u;
        asked[k].quest.asks = 0u;
        return;
    }
    let met = asked[k].met;
    var found = found_on(world, way, met);
    let pdf = light_pdf(world, way, found);
    let mirrors = (quest.asks & MIRRORS) != 0u;
    var relit: Relit;
    if mirrors || (quest.asks & RELIGHTS) != 0u {
        relit = relits[k];
    }
    if (quest.asks & RELIGHTS) != 0u {
        receive(world, &relit, way, found, pdf);
    } else {
        var position = quest.origin + quest.direction * found.t;
        var known = true;
        if mirrors {
            position = relit.start + from_pano(world, way.direction) * found.t;
        } else {
            // Where the ray ends, whatever is shown there.
            let t = found.t;
            if found.exists && (quest.asks & AS_SHOWN) != 0u {
                found = shown_surface(world, found, way.direction, quest.goal.x);
            }
            if !found.hidden && (way.by == LOOKED || (quest.asks & AS_SHOWN) != 0u) {
                position = world.capture + from_pano(world, found.at);
            }
            known = is_reached(world, found, position, quest.aimed, quest.goal);
            let what = WORLD_ASKED | select(0u, REAL_EXISTS, found.exists) | select(0u, REAL_HIDDEN, found.hidden)
                | select(0u, LIGHT_KNOWN, known);
            asked[k].told = Told(position, t, from_pano(world, found.normal), what, found.radiance, pdf, found.radiance, 0u);
        }
        if !mirrors && (quest.asks & (AS_UPDATED | FROM_OBJECT)) != 0u {
            var mirror: Way;
            if UPDATES {
                mirror = updated(k, known, found, position);
            } else {
                mirror = sent_back(k, known, found, position);
            }
            if mirror.by != NOT_FOLLOWED {
                asked[k].way = mirror;
                asked[k].quest.asks = quest.asks | MIRRORS;
                return;
            }
        }
        let front = found_by_look(found.front, met.shown, NEVER);
        let unlit = (quest.asks & UNLIT) != 0u || (mirrors && !UPDATES);
        if unlit || !(known && found.hidden && met.what == BACK_FACE && has_irradiance(world) && front.exists) {
            finish(k, mirrors, found.radiance, relit);
            return;
        }
        let mirror = relit;
        relit = relit_of(world, found, position, from_pano(world, found.normal), front);
        relit.gloss = mirror.gloss;
        relit.before = mirror.before;
        relit.changed = mirror.changed;
    }
    let next = next_way(world, &relit);
    if next.by == NOT_FOLLOWED {
        let lit = relit.own + relit.scale * relit.received / f32(max(world.hidden_samples, 1u));
        if !mirrors {
            asked[k].told.light = lit;
        }
        finish(k, mirrors, lit, relit);
        return;
    }
    asked[k].way = next;
    asked[k].quest.asks = quest.asks | RELIGHTS;
    relits[k] = relit;
}

// All is told of a ray; `radiance` is what its surface `mirrors`, if that was asked.
fn finish(k: u32, mirrors: bool, radiance: vec3f, relit: Relit) {
    if mirrors {
        var image = radiance * relit.gloss;
        if !UPDATES {
            image *= min(relit.most / max(luminance(image), 1e-30), 1.0);
        }
        asked[k].told.light += image;
        relits[k].before = relit.before + image;
    }
    asked[k].quest.asks = 0u;
}

// Tells what a surface shows since objects have changed it, and keeps what it showed before; the way to what it mirrors, not followed if
// that is not asked for. See UpdatedWorld::radiance.
fn updated(k: u32, known: bool, found: Found, position: vec3f) -> Way {
    let world = params.world;
    let quest = asked[k].quest;
    var relit: Relit;
    var way = Way(vec3f(0.0), 0.0, vec3f(0.0), NOT_FOLLOWED);
    let normal = select(found.normal, found.facet, (quest.asks & BY_FACET) != 0u);
    // Only the side that the panorama shows is known to have changed.
    if known && found.exists && !found.hidden && dot(normal, found.at) < 0.0 {
        let update = update_at(uv_from_direction(found.at));
        let matte = found.radiance * update.scattered;
        asked[k].told.light = matte - matte * update.taken;
        relit.before = matte;
        relit.changed = 1u;
        relit.gloss = update.mirror;
        if update.mirror > 0.0 {
            let facing = from_pano(world, normal);
            relit.start = world_leave(world, RealHit(position, 0.0, facing, SEEN, vec3f(0.0), true));
            way = way_of(world, relit.start, reflect(quest.direction, facing), NEVER);
        }
    }
    relits[k] = relit;
    return way;
}

// Tells what a surface sends back to an object but for what it mirrors there; the way to that, not followed if it mirrors nothing. See
// CapturedWorld::sent_back.
fn sent_back(k: u32, known: bool, found: Found, position: vec3f) -> Way {
    let world = params.world;
    let quest = asked[k].quest;
    let none = Way(vec3f(0.0), 0.0, vec3f(0.0), NOT_FOLLOWED);
    let facing = select(found.normal, found.facet, (quest.asks & BY_FACET) != 0u);
    // Only the side that the panorama shows is known to mirror.
    if !(known && found.exists && !found.hidden && dot(facing, found.at) < 0.0) {
        return none;
    }
    let reflectance = mirror_at(world, uv_from_direction(found.at));
    if reflectance <= 0.0 {
        return none;
    }
    let normal = from_pano(world, facing);
    let here = RealHit(position, 0.0, normal, SEEN, found.radiance, true);
    let beyond = world_matter(world, here).beyond;
    if all(beyond == vec3f(0.0)) {
        return none;
    }
    asked[k].told.light = found.radiance - beyond;
    var relit: Relit;
    relit.start = world_leave(world, here);
    relit.gloss = reflectance;
    relit.most = BRIGHTEST_IMAGE * luminance(beyond);
    relits[k] = relit;
    return way_of(world, relit.start, reflect(quest.direction, normal), NEVER);
}

fn answer_of(k: u32) -> Answer {
    let told = asked[k].told;
    let real_exists = (told.what & REAL_EXISTS) != 0u;
    let surface = select(SEEN, HIDDEN_SIDE, (told.what & REAL_HIDDEN) != 0u);
    let real = RealHit(told.position, told.t, told.normal, surface, told.radiance, real_exists);
    let known = (told.what & LIGHT_KNOWN) != 0u;
    return Answer(asked[k].object, real, told.light, told.pdf, known, (told.what & WORLD_ASKED) != 0u);
}

// Rays through the pixels' centres.
@compute @workgroup_size(8, 8)
fn sight(@builtin(global_invocation_id) id: vec3u) {
    if !is_held(params.rows, id) {
        return;
    }
    let at = texel_of(params.rows, id);
    var quest = quest_of(params.view.position, camera_direction(vec2f(at) + 0.5));
    quest.asks = ASKS | FOR_OBJECTS;
    asked[index_of(params.rows, at)].quest = quest;
}
