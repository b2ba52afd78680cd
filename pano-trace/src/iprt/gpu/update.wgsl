// The panorama as the objects have changed it: what a view has found goes over to the panorama's texels; see iprt/update.rs.

// What a pixel of the view shows, and what was found there.
struct ViewTexel {
    ratio: vec3f,
    depth: f32,
    gloss: vec2f,
    // 1 if it shows a real surface.
    real: u32,
    pad: u32,
}

// Of each texel of the panorama the ratio, and the gloss.
@group(0) @binding(16) var<storage, read_write> updates: array<f32>;
@group(0) @binding(21) var<storage, read_write> glosses: array<vec2f>;
@group(0) @binding(20) var<storage, read_write> view_texels: array<ViewTexel>;

// Paths that meet real surfaces see what objects change of them.
const CAPTURED: bool = true;
const UPDATES: bool = true;

fn update_at(uv: vec2f) -> Update {
    let size = vec2i(params.update_size);
    let at = footprint(size, uv);
    var sum = Update(vec3f(0.0), 0.0, 0.0);
    for (var i = 0; i < 4; i++) {
        let tap = tap_of(size, at, i);
        let k = u32(tap.texel.y * size.x + tap.texel.x);
        sum.taken += (1.0 - vec3f(updates[3u * k], updates[3u * k + 1u], updates[3u * k + 2u])) * tap.weight;
        sum.scattered += glosses[k].x * tap.weight;
        sum.mirror += glosses[k].y * tap.weight;
    }
    return sum;
}

// The pixel of the view that shows direction `d`; negative if none does.
fn texel_in_view(d: vec3f) -> vec2i {
    let size = vec2f(params.view_size);
    let there = view_pixel(params.view, size, d);
    let inside = there.exists && all(there.at >= vec2f(0.0)) && all(there.at < size);
    return select(vec2i(-1), vec2i(there.at), inside);
}

// One invocation a texel of the panorama.
@compute @workgroup_size(8, 8)
fn update(@builtin(global_invocation_id) id: vec3u) {
    if !is_held(params.rows, id) {
        return;
    }
    let world = params.world;
    let at = texel_of(params.rows, id);
    let d = direction_from_uv((vec2f(at) + 0.5) / vec2f(size_of(params.rows)));
    let found = found_by_look(look(d), d, NEVER);
    // From the capture point itself the place in the view needs no depth.
    let may_show = params.at_capture == 0u || texel_in_view(from_pano(world, d)).x >= 0;
    var ratio = vec3f(1.0);
    var gloss = vec2f(1.0, 0.0);
    if found.exists && may_show {
        let seen = world.capture + from_pano(world, found.at) - params.view.position;
        let there = texel_in_view(seen);
        if there.x >= 0 {
            let shown = view_texels[u32(there.y) * params.view_size.x + u32(there.x)];
            let distance = length(seen);
            if shown.real == 1u && abs(shown.depth - distance) <= SHOWN_WITHIN * distance {
                ratio = shown.ratio;
                gloss = shown.gloss;
            }
        }
    }
    let k = index_of(params.rows, at);
    updates[3u * k] = ratio.x;
    updates[3u * k + 1u] = ratio.y;
    updates[3u * k + 2u] = ratio.z;
    glosses[k] = gloss;
}
