// Samples of the path tracers over a captured radiance field, one invocation a pixel. In one kernel all of it would take a minute to
// compile; here several take turns, and what a pixel's sample has come to waits in memory: `encounter` looks for objects on each ray in hand,
// `march` follows it through the panorama's depth, `tell` says what that means, `advance` takes one turn.

struct Wave {
    rows: Rows,
    view: View,
    world: World,
    field: Field,
    bounces: u32,
    samples: u32,
    // Which of the counters this turn adds to.
    turn: u32,
    // Points that may wait for others, of each pixel.
    most_waiting: u32,
    clusters: vec2u,
    lights: vec2u,
}

// What a ray met in the real world.
struct Told {
    position: vec3f,
    t: f32,
    normal: vec3f,
    // Bits of LIGHT_KNOWN and the like.
    what: u32,
    // Of the surface, or of infinity.
    radiance: vec3f,
    pdf: f32,
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

// The way is one of those that light a back face.
const RELIGHTS: u32 = 128u;

// A pixel's sample between two turns.
struct Lane {
    total: vec3f,
    // IDLE once all samples are done.
    job: u32,
    numbers: Sampler,
    number: u32,
    path: Path,
    light: Light,
    point: Point,
    mirror: Mirror,
    // Points that wait.
    waiting: u32,
    shows_object: u32,
    has_later: u32,
    pad: u32,
    // twopass: the real surface at which the second pass begins.
    position: vec3f,
    surface: u32,
    normal: vec3f,
    pad1: u32,
    radiance: vec3f,
    pad2: u32,
}

@group(0) @binding(0) var<uniform> params: Wave;
@group(0) @binding(7) var<storage, read_write> asked: array<Asked>;
@group(0) @binding(8) var<storage, read_write> lanes: array<Lane>;
@group(0) @binding(9) var<storage, read_write> waiting_points: array<Point>;
// The depth field; see prt/gpu/field.wgsl.
@group(0) @binding(10) var<storage, read> inverses: array<f32>;
@group(0) @binding(11) var<storage, read> gaps: array<u32>;
@group(0) @binding(12) var<storage, read> base: array<u32>;
@group(0) @binding(13) var<storage, read> upper: array<u32>;
@group(0) @binding(14) var<storage, read_write> relits: array<Relit>;
// Rays under way in each of some turns.
@group(0) @binding(15) var<storage, read_write> counts: array<atomic<u32>>;

// Real surfaces carry their light.
const CAPTURED: bool = true;

var<private> lane: u32;
var<private> waiting: u32;
// The point in hand has come out of memory, where what it aims at is not kept.
var<private> must_aim: bool;

fn put_point_aside() {
    waiting_points[lane * params.most_waiting + waiting] = point;
    waiting += 1u;
}

fn take_point_back() -> bool {
    if waiting == 0u {
        return false;
    }
    waiting -= 1u;
    point = waiting_points[lane * params.most_waiting + waiting];
    must_aim = true;
    return true;
}

fn points_wait() -> bool {
    return waiting > 0u || point.stage < 3u;
}

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
    if (quest.asks & RELIGHTS) != 0u {
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
    var relit: Relit;
    if (quest.asks & RELIGHTS) != 0u {
        relit = relits[k];
        receive(world, &relit, way, found, pdf);
    } else {
        var position = quest.origin + quest.direction * found.t;
        // Where the ray ends, whatever is shown there.
        let t = found.t;
        if found.exists && (quest.asks & AS_SHOWN) != 0u {
            found = shown_surface(world, found, way.direction, quest.goal.x);
        }
        if !found.hidden && (way.by == LOOKED || (quest.asks & AS_SHOWN) != 0u) {
            position = world.capture + from_pano(world, found.at);
        }
        let known = is_reached(world, found, position, quest.aimed, quest.goal);
        let what = WORLD_ASKED | select(0u, REAL_EXISTS, found.exists) | select(0u, REAL_HIDDEN, found.hidden)
            | select(0u, LIGHT_KNOWN, known);
        asked[k].told = Told(position, t, from_pano(world, found.normal), what, found.radiance, pdf);
        let front = found_by_look(found.front, met.shown, NEVER);
        if !(known && found.hidden && met.what == BACK_FACE && has_irradiance(world) && front.exists) {
            asked[k].quest.asks = 0u;
            return;
        }
        relit = relit_of(world, found, position, from_pano(world, found.normal), front);
    }
    let next = next_way(world, &relit, asked[k].told.position);
    if next.by == NOT_FOLLOWED {
        asked[k].told.radiance = relit.own + relit.scale * relit.received / f32(max(world.hidden_samples, 1u));
        asked[k].quest.asks = 0u;
        return;
    }
    asked[k].way = next;
    asked[k].quest.asks = quest.asks | RELIGHTS;
    relits[k] = relit;
}

fn answer_of(k: u32) -> Answer {
    let told = asked[k].told;
    let real_exists = (told.what & REAL_EXISTS) != 0u;
    let surface = select(SEEN, HIDDEN_SIDE, (told.what & REAL_HIDDEN) != 0u);
    let real = RealHit(told.position, told.t, told.normal, surface, told.radiance, real_exists);
    let known = (told.what & LIGHT_KNOWN) != 0u;
    return Answer(asked[k].object, real, told.radiance, told.pdf, known, (told.what & WORLD_ASKED) != 0u);
}

// Rays through the pixels' centres.
@compute @workgroup_size(8, 8)
fn sight(@builtin(global_invocation_id) id: vec3u) {
    if !is_held(params.rows, id) {
        return;
    }
    let at = texel_of(params.rows, id);
    send(CAMERA, params.view.position, camera_direction(vec2f(at) + 0.5));
    ray.asks = ASKS | FOR_OBJECTS;
    asked[index_of(params.rows, at)].quest = ray;
}

// Guides of each pixel, and what its centre asks for.
@compute @workgroup_size(8, 8)
fn start(@builtin(global_invocation_id) id: vec3u) {
    if !is_held(params.rows, id) {
        return;
    }
    let at = texel_of(params.rows, id);
    let k = index_of(params.rows, at);
    let answer = answer_of(k);
    begin_pixel(at, guides_of(answer.object, answer.real, asked[k].quest.direction));
}

// The first ray of each pixel.
@compute @workgroup_size(8, 8)
fn begin(@builtin(global_invocation_id) id: vec3u) {
    if !is_held(params.rows, id) {
        return;
    }
    texel = texel_of(params.rows, id);
    lane = index_of(params.rows, texel);
    started = pixels[lane];
    point.stage = 3u;
    last = started.most;
    begin_sample();
    put_lane();
}

// Keeps what the next turn needs.
fn put_lane() {
    ray.asks = question();
    asked[lane].quest = ray;
    lanes[lane] = Lane(
        total, job, numbers, number, path, light, point, mirror, waiting, select(0u, 1u, shows_object), select(0u, 1u, later.exists), 0u,
        later.first.real.position, later.first.real.surface, later.first.real.normal, 0u, later.first.real.radiance, 0u
    );
}

fn take_lane() {
    let kept = lanes[lane];
    ray = asked[lane].quest;
    started = pixels[lane];
    pixel = started.pixel;
    last = started.most;
    total = kept.total;
    job = kept.job;
    numbers = kept.numbers;
    number = kept.number;
    path = kept.path;
    light = kept.light;
    point = kept.point;
    mirror = kept.mirror;
    waiting = kept.waiting;
    shows_object = kept.shows_object == 1u;
    later.exists = kept.has_later == 1u;
    later.first.what = REAL;
    later.first.real = RealHit(kept.position, 0.0, kept.normal, kept.surface, kept.radiance, true);
    // From anywhere on its side.
    later.first.direction = -kept.normal;
    later.path = second_pass();
    must_aim = point.stage < 3u || job == BLOCKED || job == CHANGE;
}

@compute @workgroup_size(8, 8)
fn advance(@builtin(global_invocation_id) id: vec3u) {
    if !is_held(params.rows, id) {
        return;
    }
    texel = texel_of(params.rows, id);
    lane = index_of(params.rows, texel);
    if asked[lane].quest.asks != 0u || lanes[lane].job == IDLE {
        return;
    }
    take_lane();
    var answer = answer_of(lane);
    var goes_on = true;
    loop {
        if POINTS && must_aim {
            must_aim = false;
            look_for_objects();
        }
        goes_on = turn(answer);
        if !goes_on || job != IDLE {
            break;
        }
        answer.object.instance = NOTHING;
        answer.real.exists = false;
    }
    pixels[lane].pixel = pixel;
    put_lane();
}
