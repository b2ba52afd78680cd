// What a frame shows, for every tracer: the camera, the objects' bounds, what is at the centres of pixels, and what pixels come to. A
// shader that includes this has `view: View` and `world: World` in its uniform `params`.

struct View {
    position: vec3f,
    // 1 for the whole sphere.
    panorama: u32,
    // Axes of the camera's frame in the world.
    right: vec3f,
    objects: u32,
    up: vec3f,
    // Where the boxes of each object begin and how many there are, in the order of the balls.
    boxes: u32,
    back: vec3f,
    pad: u32,
    focal: vec2f,
    center: vec2f,
    // Which random numbers: frame and seed.
    stream: vec2u,
    // Roots of the trees over objects and over proxies that are meshes.
    roots: vec2u,
    emitters: vec2u,
    balls: vec2u,
}

// What a pixel's samples have come to.
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
}

// A pixel with one more sample, which shows an object or not; what is not finite counts as black.
fn with_sample(pixel: Pixel, value: vec3f, shows_object: bool) -> Pixel {
    var with_it = pixel;
    if is_finite3(value) {
        with_it.object += select(vec3f(0.0), value, shows_object);
        with_it.delta += select(value, vec3f(0.0), shows_object);
    } else {
        with_it.discarded += 1u;
    }
    with_it.covered += select(0u, 1u, shows_object);
    return with_it;
}

// Tables of objects, proxies and light.
@group(0) @binding(4) var<storage, read> table_words: array<u32>;
// The environment, and what goes with it.
@group(0) @binding(5) var<storage, read> pictures: array<f32>;

// No end of a ray.
const NEVER: f32 = 3e38;

fn word(i: u32) -> u32 {
    return table_words[i];
}

fn objects() -> ObjectTables {
    return ObjectTables(params.view.objects, params.view.emitters.x, params.view.emitters.y);
}

// World direction through a point of the picture, in pixels.
fn camera_direction(at: vec2f) -> vec3f {
    let view = params.view;
    var local: vec3f;
    if view.panorama == 1u {
        local = direction_from_uv(at / vec2f(size_of(params.rows)));
    } else {
        local = normalize(vec3f((at.x - view.center.x) / view.focal.x, (view.center.y - at.y) / view.focal.y, -1.0));
    }
    return view.right * local.x + view.up * local.y + view.back * local.z;
}

// Where a picture shows a direction, in pixels.
struct InView {
    at: vec2f,
    exists: bool,
}

// Where a view of `size` pixels shows the world direction `d`; see Camera::pixel.
fn view_pixel(view: View, size: vec2f, d: vec3f) -> InView {
    let local = vec3f(dot(view.right, d), dot(view.up, d), dot(view.back, d));
    if view.panorama == 1u {
        return InView(uv_from_direction(local) * size, true);
    }
    return InView(view.center + view.focal * vec2f(local.x, -local.y) / -local.z, local.z < 0.0);
}

// A ball's centre and radius.
fn ball_at(begin: u32, i: u32) -> vec4f {
    return vec4f(vec3_at(begin + 4u * i), number_at(begin + 4u * i + 3u));
}

// Whether the beam, `spread` wide, reaches one of an object's boxes; see Beam::may_meet.
fn may_meet_boxes(object: u32, axis: vec3f, spread: f32) -> bool {
    let begin = word(params.view.boxes + 2u * object);
    let inverse = 1.0 / select(axis, vec3f(1e-20), abs(axis) < vec3f(1e-20));
    for (var i = 0u; i < word(params.view.boxes + 2u * object + 1u); i++) {
        let a = (vec3_at(begin + 6u * i) - spread - params.view.position) * inverse;
        let b = (vec3_at(begin + 6u * i + 3u) + spread - params.view.position) * inverse;
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
    for (var i = 0u; i < params.view.balls.y; i++) {
        let ball = ball_at(params.view.balls.x, i);
        let to = ball.xyz - params.view.position;
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

// What is at a pixel's centre: `real` is the surface, if it is a real one, and `matter` what it is made of.
struct Guides {
    pixel: Pixel,
    real: RealHit,
    matter: Matter,
}

// See Tracer::guides_of; the ray along `d` meets nothing before `real`.
fn guides_of(object: Hit, real: RealHit, d: vec3f) -> Guides {
    var guides: Guides;
    guides.pixel.depth = -1.0;
    guides.real = real;
    if real.exists {
        guides.matter = world_matter(params.world, real);
        guides.pixel.depth = real.t;
        guides.pixel.normal = real.normal;
        guides.pixel.albedo = guides.matter.reflectance;
    } else if object.instance != NOTHING {
        let surface = surface_at(objects(), object, d);
        guides.pixel.depth = object.t;
        guides.pixel.normal = bsdf_at(surface.material, surface.geometric, surface.normal, -d).normal;
        guides.pixel.albedo = surface.material.base_color;
    }
    return guides;
}
