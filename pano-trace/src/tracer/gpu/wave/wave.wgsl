// Samples of the path tracers over a captured radiance field, one invocation a pixel: `follow.wgsl` answers the ray in hand, `advance`
// takes one turn. What a pixel's sample has come to waits in memory.

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

// A pixel's sample between two turns.
struct Lane {
    total: vec3f,
    // IDLE once all samples are done.
    job: u32,
    numbers: Sampler,
    pad3: u32,
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
@group(0) @binding(8) var<storage, read_write> lanes: array<Lane>;
@group(0) @binding(9) var<storage, read_write> waiting_points: array<Point>;

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
    take_pixel(lane);
    point.stage = 3u;
    last = started.most;
    begin_sample();
    put_lane();
}

// Keeps what the next turn needs.
fn put_lane() {
    put_pixel(lane);
    ray.asks = question();
    asked[lane].quest = ray;
    lanes[lane] = Lane(
        total, job, numbers, 0u, path, light, point, mirror, waiting, select(0u, 1u, shows_object), select(0u, 1u, later.exists), 0u,
        later.first.real.position, later.first.real.surface, later.first.real.normal, 0u, later.first.real.radiance, 0u
    );
}

fn take_lane() {
    let kept = lanes[lane];
    ray = asked[lane].quest;
    take_pixel(lane);
    last = started.most;
    total = kept.total;
    job = kept.job;
    numbers = kept.numbers;
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
    put_lane();
}
