// One turn of a tracer. The CPU's functions call each other; here samples go from ray to ray: each turn takes the answer to what was
// asked of the ray in hand, adds what that comes to (everything counts linearly, so that a factor goes along instead of a sum coming
// back), and finds the next ray. Walks that wait for another to end are few: see `Later`, `Mirror` and `Point`. The order of the random
// numbers is the CPU's.
//
// A shader that includes this says whether real surfaces are `CAPTURED`: whether they carry their light, so that paths end there and
// their change is asked for. Points then wait for others: `put_point_aside`, and `take_point_back` if there is one. While
// `points_wait`, nothing later begins.

var<private> texel: vec2i;
var<private> started: Started;
// The sample in hand, and before which one to stop.
var<private> number: u32;
var<private> last: u32;
var<private> shows_object: bool;
var<private> later: Later;
var<private> mirror: Mirror;
var<private> point: Point;

// Begins the next sample that can find something; false if there is none.
fn begin_sample() -> bool {
    total = vec3f(0.0);
    shows_object = false;
    path.mixed = started.mixed;
    while number < last {
        numbers = sampler_of(vec2u(texel), number, params.view.stream.x, params.view.stream.y);
        let drawn = draw();
        let looks = drawn.w < started.share;
        if looks || started.mixed == 1u {
            send(CAMERA, params.view.position, camera_direction(vec2f(texel) + drawn.xy));
            ray.goal = vec3f(drawn.z, select(0.0, 1.0, looks), 0.0);
            return true;
        }
        count_sample(vec3f(0.0));
    }
    return false;
}

// The sample in hand has come to that.
fn count_sample(value: vec3f) {
    if ADAPTIVE {
        started.sum += luminance(value);
        if number % BATCH == BATCH - 1u {
            let batch = started.sum / f32(BATCH);
            let before = batch - started.mean;
            started.sum = 0.0;
            started.mean += before / f32(number / BATCH + 1u);
            started.squares += before * (batch - started.mean);
        }
    }
    number += 1u;
}

// What is kept of a pixel.
fn put_pixel(k: u32) {
    started.pixel = pixel;
    started.taken = number;
    pixels[k] = started;
}

fn take_pixel(k: u32) {
    started = pixels[k];
    pixel = started.pixel;
    number = started.taken;
}

// Adds what the sample came to; false if it was the last one.
fn end_sample() -> bool {
    pixel = with_sample(pixel, total, shows_object);
    count_sample(select(vec3f(0.0), total, is_finite3(total)));
    return begin_sample();
}

// What is asked of the ray in hand.
fn question() -> u32 {
    if job == IDLE {
        return 0u;
    }
    if job == PATH || job == SHADOW || job == AIMED {
        return path_question() | select(0u, FROM_OBJECT | select(0u, BY_FACET, job == SHADOW), CAPTURED && path.from_object == 1u);
    }
    var asks = ASKS | select(0u, FOR_OBJECTS, job != CAMERA || path.mixed == 1u);
    let far = ray.aimed == AT_INFINITY;
    switch job {
        case CAMERA: {
            asks |= AS_SHOWN;
        }
        case BLOCKED, LIGHT_PAIR: {
            asks |= IF_MET | BEHIND_OBJECTS | select(0u, FOR_ANY, far || (job == BLOCKED && ray.aimed == AT_SURFACE));
        }
        case CHANGE: {
            asks |= BEHIND_OBJECTS | select(IF_MET, 0u, point.stage == 3u && has_second_order());
        }
        case PAIR: {
            asks |= BEHIND_OBJECTS;
        }
        case REFLECTED: {
            asks |= IF_MET | BEHIND_OBJECTS;
        }
        default: {
        }
    }
    return asks;
}

// Rays that the CPU would count for it.
fn count_rays(answer: Answer) {
    if job == IDLE {
        return;
    }
    let twice = job == LIGHT_PAIR || job == PAIR || ((job == BLOCKED || job == CHANGE || job == REFLECTED) && answer.asked);
    let again = job == BLOCKED && ray.aimed == AT_ANYTHING && answer.real.exists;
    pixel.rays += select(1u, 2u, twice) + select(0u, 1u, again);
}

// twopass: the real scene alone, to be subtracted.
fn second_pass() -> Path {
    var second = path_of(vec3f(-1.0), params.bounces, false);
    second.depth = -1;
    return second;
}

// The effort for the change of what the camera sees.
fn seen_effort() -> Effort {
    return Effort(1.0, LEAST_EFFORT, started.boost, u32(sqrt(started.boost)));
}

// Adds what the answer comes to, and says what is to be done.
fn reckon(answer: Answer, first: ptr<function, First>, effort: ptr<function, Effort>) -> u32 {
    let met = answer.object.instance != NOTHING;
    let what = (*first).what;
    switch job {
        case CAMERA: {
            if what == OBJECT {
                shows_object = true;
                path = path_of(vec3f(1.0), params.bounces, true);
                return AT_VERTEX;
            }
            let looks = ray.goal.y > 0.0;
            if what == REAL && METHOD != IBL && looks {
                path = path_of(vec3f(1.0 / started.share), params.bounces, true);
                if METHOD == DPT {
                    *effort = seen_effort();
                    return AT_POINT;
                }
                if METHOD == ONE_PASS {
                    return AT_PAIR;
                }
                path.depth = -1;
                later = Later(true, *first, second_pass());
                return AT_VERTEX;
            }
            return DONE;
        }
        case PATH, SHADOW, AIMED: {
            return reckon_path(answer, what);
        }
        case BLOCKED: {
            // What is aimed at anything may lie before the object.
            if met && answer.known && (what == OBJECT || ray.aimed != AT_ANYTHING) {
                let cosine = dot(ray.direction, point.normal);
                let weights = weights_of(point, ray.direction, cosine, answer.pdf);
                total -= point.scale * answer.light * (cosine * weights.blocked);
            }
            return NEXT_STRATEGY;
        }
        case CHANGE: {
            return reckon_change(answer, first, effort);
        }
        case LIGHT_PAIR: {
            if METHOD == ONE_PASS && answer.known && what == OBJECT && answer.pdf > 0.0 {
                let weight = select(1.0, balance(answer.pdf, light.pdf), MIS == BALANCE);
                total -= light.value * answer.light * (weight / answer.pdf);
            }
            return GO_ON;
        }
        case PAIR: {
            return reckon_pair(answer, first, effort);
        }
        case REFLECTED: {
            let bright = luminance(answer.light);
            let sent = mirror.beyond;
            let shows = CAPTURED && what == OBJECT && bright >= luminance(sent);
            mirror.beyond = vec3f(0.0);
            if shows {
                total -= sent / started.share;
                path = path_of(vec3f(luminance(sent) / (bright * started.share)), params.bounces - 1u, true);
                return AT_VERTEX;
            }
            return FINISHED;
        }
        default: {
            return FINISHED;
        }
    }
}

// A direction in which a point may change.
fn reckon_change(answer: Answer, first: ptr<function, First>, effort: ptr<function, Effort>) -> u32 {
    let cosine = dot(ray.direction, point.normal);
    if (*first).what == OBJECT {
        let weights = weights_of(point, ray.direction, cosine, answer.pdf);
        let scale = point.scale * cosine;
        let blocks = weights.blocked > 0.0 && !(MIS == LIGHT_ONLY && weights.light_finds_it);
        var then = NEXT_STRATEGY;
        if blocks && answer.known {
            total -= scale * answer.light * weights.blocked;
        }
        if weights.sent > 0.0 {
            path = path_of(scale * weights.sent, point.bounces - 1u, true);
            then = AT_VERTEX;
        }
        if !CAPTURED && blocks && !answer.known {
            // The light behind the object comes first.
            later = Later(then == AT_VERTEX, *first, path);
            path = path_of(-scale * weights.blocked, point.bounces - 1u, false);
            (*first).what = REAL;
            then = AT_VERTEX;
        }
        return then;
    }
    if (*first).what == REAL && point.stage == 3u && has_second_order() {
        let density = point.cosine_rate * cosine_pdf(ray.direction, cosine);
        path = path_of(point.scale * (cosine / density), point.bounces - 1u, true);
        *effort = of_another();
        return AT_POINT;
    }
    return NEXT_STRATEGY;
}

// onepass: a direction in both scenes.
fn reckon_pair(answer: Answer, first: ptr<function, First>, effort: ptr<function, Effort>) -> u32 {
    let bounces = path.remaining - 1u;
    if METHOD == ONE_PASS && (*first).what == OBJECT {
        let outer = path.outer;
        if answer.known {
            var seen = path;
            seen.mixed = 0u;
            total -= outer * answer.light * weight_of(seen, First(INFINITY, answer.object, answer.real, ray.direction), answer.pdf);
        } else {
            later = Later(true, *first, path_of(-outer, bounces, false));
            later.first.what = REAL;
        }
        path = path_of(outer, bounces, true);
        return AT_VERTEX;
    }
    if METHOD == ONE_PASS && (*first).what == REAL && bounces > 0u {
        path = path_of(path.outer, bounces, true);
        *effort = of_a_paths_end();
        return select(select(AT_PAIR, AT_POINT, CAPTURED), FINISHED, CAPTURED && !SECOND_ORDER);
    }
    return FINISHED;
}

// Light at the end of a path that goes no farther.
fn end_path(answer: Answer, first: First, weight: f32, effort: ptr<function, Effort>) -> u32 {
    add_end(answer, weight);
    if CAPTURED && SECOND_ORDER && first.what == REAL && path.mixed == 1u && path.remaining > 0u {
        path.outer *= path.throughput;
        if path.from_object == 1u && path.found_by < 0.0 {
            *effort = of_an_image();
        }
        return AT_POINT;
    }
    return FINISHED;
}

// Takes the answer to what was asked of the ray in hand, none if there was none; false if that was the end of the last sample.
fn turn(answer: Answer) -> bool {
    var first = first_of(answer);
    count_rays(answer);
    let was = job;
    var effort = of_a_paths_end();
    var then = reckon(answer, &first, &effort);
    job = IDLE;
    if then == GO_ON {
        send(light.next_job, light.next_origin, light.next_direction);
        if job != IDLE {
            return true;
        }
        then = FINISHED;
    }
    var weight = 1.0;
    if then == AT_VERTEX {
        weight = weight_of(path, first, answer.pdf);
        // The vertices at which twopass begins are real ones, too.
        if first.what == INFINITY || (CAPTURED && first.what == REAL && path.depth >= 0) {
            then = end_path(answer, first, weight, &effort);
        }
    }
    if then == FINISHED && later.exists && !points_wait() {
        later.exists = false;
        first = later.first;
        path = later.path;
        then = AT_VERTEX;
        weight = 1.0;
    }
    var matter: Matter;
    if first.what == REAL && (then == AT_POINT || then == AT_VERTEX || then == AT_PAIR) {
        matter = world_matter(params.world, first.real);
    }
    if CAPTURED && was == CAMERA {
        mirror.origin = world_leave(params.world, first.real);
        mirror.direction = reflect(ray.direction, first.real.normal);
        mirror.beyond = matter.beyond;
    }
    if then == AT_VERTEX || then == AT_PAIR {
        scatter(first, matter, METHOD == ONE_PASS && then == AT_PAIR, weight);
        return true;
    }
    if POINTS {
        if then == AT_POINT {
            begin_point(first.real, matter, effort);
        }
        if then != DONE && next_strategy() {
            return true;
        }
    }
    if later.exists {
        // Its turn comes next.
        return true;
    }
    if CAPTURED && any(mirror.beyond > vec3f(0.0)) {
        send(REFLECTED, mirror.origin, mirror.direction);
        return true;
    }
    return end_sample();
}

