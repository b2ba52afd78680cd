// Lamps as spheres that stand somewhere, the points of them that are sampled, and what a surface gets of one that nothing blocks; see
// lights.rs and shade.rs.

// A lamp, seen from a point.
struct Toward {
    // Unit direction to its middle.
    axis: vec3f,
    // Cosine and sine of its angular radius.
    cosine: f32,
    // On a surface that faces it.
    irradiance: vec3f,
    sine: f32,
    // How far rays towards it are followed.
    end: f32,
}

fn toward_lamp(lamp: u32, x: vec3f) -> Toward {
    let at = params.lighting.lamps + LAMP_WORDS * lamp;
    let direction = vec3_at(at);
    let irradiance = vec3_at(at + 3u);
    let sine = number_at(at + 7u);
    let standing = number_at(at + 8u);
    if standing < 0.0 {
        return Toward(direction, number_at(at + 6u), irradiance, sine, NEVER);
    }
    let to = vec3_at(at + 9u) - x;
    let radius = standing * min(sine, MAX_SINE);
    let far = max(length(to), max(radius / MAX_SINE, 1e-37));
    let seen_sine = radius / far;
    let closer = standing / far;
    let cosine = sqrt(1.0 - seen_sine * seen_sine);
    return Toward(normalized_or(to, direction), cosine, irradiance * (closer * closer), seen_sine, far - radius);
}

// Whether a surface faces away from the whole lamp.
fn is_below(toward: Toward, normal: vec3f) -> bool {
    return toward.cosine > 0.0 && dot(toward.axis, normal) <= -toward.sine;
}

// Where the pattern of so many points begins in the tables.
fn pattern_at(points: u32) -> u32 {
    return params.patterns + POINT_WORDS * (points * (points - 1u) / 2u);
}

// Direction to point `i` of a pattern, which is turned by the unit vector `turn`.
fn pattern_direction(pattern: u32, i: u32, toward: Toward, turn: vec2f) -> vec3f {
    let at = pattern + POINT_WORDS * i;
    let own = vec2f(number_at(at + 1u), number_at(at + 2u));
    let place = vec2f(own.x * turn.x - own.y * turn.y, own.y * turn.x + own.x * turn.y);
    let height = number_at(at) * (1.0 - toward.cosine);
    let radius = sqrt(max(height * (2.0 - height), 0.0));
    let across = tangent_of(toward.axis) * place.x + bitangent_of(toward.axis) * place.y;
    return toward.axis * (1.0 - height) + across * radius;
}

// Which response of a surface is asked for.
const TO_COSINE: u32 = 0u;
const TO_LOBE: u32 = 1u;
const TO_BSDF: u32 = 2u;

// What a surface sends back of a lamp that nothing blocks; `axis` is that of a lobe.
fn unshadowed(toward: Toward, horizon: vec3f, response: u32, axis: vec3f) -> vec3f {
    if is_below(toward, horizon) {
        return vec3f(0.0);
    }
    var sum = vec3f(0.0);
    for (var i = 0u; i < params.response_count; i++) {
        let d = pattern_direction(params.response, i, toward, vec2f(1.0, 0.0));
        if response == TO_COSINE {
            sum += vec3f(max(dot(d, horizon), 0.0));
        } else if response == TO_LOBE {
            sum += vec3f(lobe_pdf(axis, params.lighting.gloss_roughness, d));
        } else {
            sum += bsdf_eval(here.bsdf, d).f_cos;
        }
    }
    return sum * toward.irradiance * (2.0 / (f32(params.response_count) * (1.0 + toward.cosine)));
}

// Irradiance of a lamp that nothing blocks.
fn received(toward: Toward, normal: vec3f) -> vec3f {
    let cosine = dot(toward.axis, normal);
    if cosine >= toward.sine && toward.cosine > 0.0 {
        return toward.irradiance * cosine;
    }
    return unshadowed(toward, normal, TO_COSINE, normal);
}

// Whether the bounds of any object reach into the cone between `x` and the lamp.
fn objects_may_block(toward: Toward, x: vec3f) -> bool {
    for (var i = 0u; i < params.clusters.y; i++) {
        let ball = ball_at(params.clusters.x, i);
        let to = ball.xyz - x;
        let far = length(to);
        if far <= ball.w {
            return true;
        }
        let sin_b = ball.w / far;
        let cos_b = sqrt(max(1.0 - sin_b * sin_b, 0.0));
        let sum = toward.cosine * cos_b - toward.sine * sin_b;
        if toward.cosine <= -cos_b || dot(to, toward.axis) / far >= sum - 1e-5 {
            return true;
        }
    }
    return false;
}
