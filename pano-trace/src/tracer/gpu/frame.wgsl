// A frame of the path tracers: what is bound, the camera, pixels before their first sample. One invocation a pixel.

struct Trace {
    rows: Rows,
    position: vec3f,
    // 1 for the whole sphere.
    panorama: u32,
    // Axes of the camera's frame in the world.
    right: vec3f,
    bounces: u32,
    up: vec3f,
    // Samples that a pixel takes.
    samples: u32,
    back: vec3f,
    // Samples of this submission.
    begin: u32,
    focal: vec2f,
    center: vec2f,
    end: u32,
    frame: u32,
    seed: u32,
    objects: u32,
    // Roots of the trees over objects and over proxies that are meshes.
    roots: vec2u,
    emitters: vec2u,
    balls: vec2u,
    clusters: vec2u,
    // Points of the light: position and squared distance from the viewer, or direction and 0.
    lights: vec2u,
    // Where the boxes of each object begin and how many there are, in the order of the balls.
    boxes: u32,
    pad: u32,
    world: World,
}

// A pixel, and what its samples have come to.
struct Pixel {
    object: vec3f,
    covered: u32,
    delta: vec3f,
    discarded: u32,
    // At the centre.
    normal: vec3f,
    // Negative where there is nothing.
    depth: f32,
    albedo: vec3f,
    rays: u32,
    // Samples it takes; after `start` one in how many its centre asks for.
    most: u32,
    // How many of the frame's samples each stands for.
    boost: f32,
    // Whether an object may be seen.
    mixed: u32,
    // How often each sample looks for changes.
    share: f32,
}

@group(0) @binding(0) var<uniform> params: Trace;
// Tables of objects, proxies and the light's distribution.
@group(0) @binding(4) var<storage, read> table_words: array<u32>;
// The environment, and what goes with it.
@group(0) @binding(5) var<storage, read> pictures: array<f32>;
@group(0) @binding(6) var<storage, read_write> pixels: array<Pixel>;

// Which estimator, and which strategies for direct light: in the order of TraceParams.
override METHOD: u32 = 0u;
const DPT: u32 = 0u;
const ONE_PASS: u32 = 1u;
const TWO_PASS: u32 = 2u;
const IBL: u32 = 3u;
override MIS: u32 = 0u;
const BALANCE: u32 = 0u;
const LIGHT_ONLY: u32 = 1u;
const BSDF_ONLY: u32 = 2u;
// Some objects shine; every pixel and direction is asked for a change; changed surfaces change one another.
override EMITTERS: bool = true;
override EVERYWHERE: bool = false;
override SECOND_ORDER: bool = true;

// No end of a ray.
const NEVER: f32 = 3e38;

fn word(i: u32) -> u32 {
    return table_words[i];
}

fn objects() -> ObjectTables {
    return ObjectTables(params.objects, params.emitters.x, params.emitters.y);
}

// World direction through a point of the picture, in pixels.
fn camera_direction(at: vec2f) -> vec3f {
    var local: vec3f;
    if params.panorama == 1u {
        local = direction_from_uv(at / vec2f(size_of(params.rows)));
    } else {
        local = normalize(vec3f((at.x - params.center.x) / params.focal.x, (params.center.y - at.y) / params.focal.y, -1.0));
    }
    return params.right * local.x + params.up * local.y + params.back * local.z;
}

// A ball's centre and radius.
fn ball_at(begin: u32, i: u32) -> vec4f {
    return vec4f(vec3_at(begin + 4u * i), number_at(begin + 4u * i + 3u));
}

// Whether the beam, `spread` wide, reaches one of an object's boxes; see Beam::may_meet.
fn may_meet_boxes(object: u32, axis: vec3f, spread: f32) -> bool {
    let begin = word(params.boxes + 2u * object);
    let inverse = 1.0 / select(axis, vec3f(1e-20), abs(axis) < vec3f(1e-20));
    for (var i = 0u; i < word(params.boxes + 2u * object + 1u); i++) {
        let a = (vec3_at(begin + 6u * i) - spread - params.position) * inverse;
        let b = (vec3_at(begin + 6u * i + 3u) + spread - params.position) * inverse;
        let enter = min(a, b);
        let leave = max(a, b);
        if min(min(leave.x, leave.y), leave.z) >= max(max(max(enter.x, enter.y), enter.z), 0.0) {
            return true;
        }
    }
    return false;
}

// See Tracer::may_see_objects.
fn may_see_objects(corner: vec2f) -> bool {
    let axis = camera_direction(corner + 0.5);
    var widest = 1e-6;
    for (var i = 0; i < 4; i++) {
        widest = max(widest, length(camera_direction(corner + vec2f(f32(i % 2), f32(i / 2))) - axis));
    }
    let spread = 1.5 * widest;
    for (var i = 0u; i < params.balls.y; i++) {
        let ball = ball_at(params.balls.x, i);
        let to = ball.xyz - params.position;
        let along = dot(to, axis);
        let distance = length(to);
        if distance <= ball.w || spread > WIDEST_BEAM {
            return true;
        }
        let wider = spread * (distance + ball.w);
        let radius = ball.w + wider;
        let off = to - axis * along;
        if along > -radius && dot(off, off) <= radius * radius && may_meet_boxes(i, axis, wider) {
            return true;
        }
    }
    return false;
}

// Guides of each pixel, and what its centre asks for.
@compute @workgroup_size(8, 8)
fn start(@builtin(global_invocation_id) id: vec3u) {
    if !is_held(params.rows, id) {
        return;
    }
    let texel = texel_of(params.rows, id);
    let corner = vec2f(texel);
    var pixel: Pixel;
    pixel.mixed = select(0u, 1u, may_see_objects(corner));
    pixel.depth = -1.0;
    var thinning = MOST_THINNING;
    let d = camera_direction(corner + 0.5);
    let object = trace_ray(params.roots.x, params.position, d, NEVER, false);
    let real = world_hit(params.world, params.roots.y, params.position, d, object.t);
    if real.exists {
        pixel.depth = real.t;
        pixel.normal = real.normal;
        pixel.albedo = world_reflectance(params.world, real);
        thinning = thinning_of(real);
    } else if object.instance != NOTHING {
        let surface = surface_at(objects(), object, d);
        pixel.depth = object.t;
        pixel.normal = bsdf_at(surface.material, surface.geometric, surface.normal, -d).normal;
        pixel.albedo = surface.material.base_color;
    }
    if METHOD == IBL {
        thinning = NO_SAMPLES;
    }
    if pixel.mixed == 1u || METHOD == ONE_PASS || METHOD == TWO_PASS || EVERYWHERE {
        thinning = 1u;
    }
    pixel.most = thinning;
    pixels[index_of(params.rows, texel)] = pixel;
}

