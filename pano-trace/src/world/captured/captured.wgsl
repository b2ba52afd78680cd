// The radiance field of a panorama with depth: what its surfaces are made of, and where its light comes from; see world/captured/mod.rs,
// irradiance.rs and lamps.rs. Comes after environment.wgsl and prt/gpu/field.wgsl, in shaders whose uniform has `World` and `Field`.

struct World {
    // Columns of the turn from the world into the panorama's frame.
    pano_x: vec3f,
    // Largest diffuse reflectance.
    cap: f32,
    pano_y: vec3f,
    lamps: u32,
    pano_z: vec3f,
    lamp_count: u32,
    capture: vec3f,
    // Of light samples, where a lamp is seen.
    lamp_share: f32,
    light_size: vec2u,
    light: u32,
    // Where among the words is which texel infinity shows at each; NO_INFINITY if the panorama has depth everywhere.
    infinity: u32,
    size: vec2u,
    // The grids of irradiance; the coarse one has no size if nothing was measured.
    fine: u32,
    coarse: u32,
    fine_size: vec2u,
    coarse_size: vec2u,
    // Pairs of rays by which a back face is lit.
    hidden_samples: u32,
    // Reflectances of mirrors; no size if nothing mirrors.
    mirrors: u32,
    mirrors_size: vec2u,
    seed: u32,
    pad0: u32,
    pad1: u32,
    pad2: u32,
}

// Surfaces that the panorama shows, and sides that are only assumed.
const SEEN: u32 = 0u;
const HIDDEN_SIDE: u32 = 1u;

fn place_in_pano(world: World, position: vec3f) -> vec3f {
    return to_pano(world, position - world.capture);
}

// Where a ray that leaves a real surface starts.
fn world_leave(world: World, hit: RealHit) -> vec3f {
    return hit.position + hit.normal * (LEAVE * length(hit.position - world.capture));
}

// How alike the surface is to that of a texel of irradiance.
fn similarity(position: vec3f, normal: vec3f, texel: u32) -> f32 {
    if word(texel + 9u) == 0u {
        return 0.0;
    }
    let off = dot(normal, vec3_at(texel + 3u) - position) / (0.02 * length(position));
    let facing = max(dot(normal, vec3_at(texel + 6u)), 0.0);
    let fourth = facing * facing * facing * facing;
    let alike = exp(-off * off) * fourth * fourth;
    return select(alike, 0.0, alike < LEAST_ALIKE);
}

// Irradiance at `position` on a surface with `normal`, both in the panorama's frame.
fn irradiance_at(world: World, position: vec3f, normal: vec3f) -> vec3f {
    let uv = uv_from_direction(position);
    // The fine grid, the coarse one, and whatever it has where nothing is alike nearby.
    for (var k = 0u; k < 3u; k++) {
        let begin = select(world.coarse, world.fine, k == 0u);
        let size = vec2i(select(world.coarse_size, world.fine_size, k == 0u));
        let least = select(1e-2, 0.0, k == 2u);
        var sum = vec3f(0.0);
        var weights = 0.0;
        // The four texels around, and then all within two of the one in which it lies.
        for (var wide = 0; wide < 2 && weights <= least; wide++) {
            let taps = footprint(size, uv);
            let middle = vec2i(uv * vec2f(size));
            for (var i = 0; i < select(4, 25, wide == 1); i++) {
                var tap: Tap;
                if wide == 0 {
                    tap = tap_of(size, taps, i);
                } else {
                    let at = middle + vec2i(i % 5, i / 5) - 2;
                    tap = Tap(wrap_texel(size, at.x, at.y), 1.0);
                }
                let texel = begin + TEXEL_WORDS * u32(tap.texel.y * size.x + tap.texel.x);
                var weight = tap.weight;
                if wide == 1 && least == 0.0 {
                    weight = f32(word(texel + 9u));
                } else {
                    weight *= similarity(position, normal, texel);
                }
                sum += vec3_at(texel) * weight;
                weights += weight;
            }
        }
        if weights > least {
            return sum / weights;
        }
    }
    return vec3f(0.0);
}

fn has_irradiance(world: World) -> bool {
    return world.coarse_size.x > 0u;
}

fn world_matter(world: World, hit: RealHit) -> Matter {
    if hit.surface != SEEN || !has_irradiance(world) {
        return Matter(vec3f(0.0), vec3f(0.0));
    }
    let received = irradiance_at(world, place_in_pano(world, hit.position), to_pano(world, hit.normal));
    let diffuse = received * (world.cap / PI);
    return Matter(reflectance_from(hit.radiance, received, world.cap), max(hit.radiance - diffuse, vec3f(0.0)));
}

// The reflectance of the mirror that the panorama shows there, 0 for none.
fn mirror_at(world: World, uv: vec2f) -> f32 {
    let size = vec2i(world.mirrors_size);
    if size.x == 0 {
        return 0.0;
    }
    let at = footprint(size, uv);
    var sum = 0.0;
    for (var i = 0; i < 4; i++) {
        let tap = tap_of(size, at, i);
        sum += number_at(world.mirrors + u32(tap.texel.y * size.x + tap.texel.x)) * tap.weight;
    }
    return sum;
}

// A lamp as a point of the panorama's frame sees it: no cone if it does not.
struct SeenLamp {
    cone: Cone,
    weight: f32,
}

fn lamp_at(world: World, i: u32, from_: vec3f) -> SeenLamp {
    let at = world.lamps + LAMP_WORDS * i;
    let ball = vec4f(vec3_at(at), number_at(at + 3u));
    let to = ball.xyz - from_;
    return SeenLamp(cone_around(ball, from_), number_at(at + 4u) / dot(to, to));
}

// Density per steradian of light samples at `from_` that are aimed at lamps, and their share.
struct LampLight {
    pdf: f32,
    share: f32,
}

fn lamp_light(world: World, from_: vec3f, d: vec3f) -> LampLight {
    var density = 0.0;
    var total = 0.0;
    for (var i = 0u; i < world.lamp_count; i++) {
        let lamp = lamp_at(world, i, from_);
        if lamp.cone.cap > 0.0 {
            total += lamp.weight;
            if cone_contains(lamp.cone, d) {
                density += lamp.weight / (TAU * lamp.cone.cap);
            }
        }
    }
    if total <= 0.0 {
        return LampLight(0.0, 0.0);
    }
    return LampLight(density / total, world.lamp_share);
}

// A direction towards a lamp, for points that see one.
fn lamps_sample(world: World, from_: vec3f, u: vec2f) -> vec3f {
    var total = 0.0;
    for (var i = 0u; i < world.lamp_count; i++) {
        let lamp = lamp_at(world, i, from_);
        total += select(0.0, lamp.weight, lamp.cone.cap > 0.0);
    }
    var pick = u.x * total;
    var chosen: Cone;
    var across = 0.5;
    for (var i = 0u; i < world.lamp_count; i++) {
        let lamp = lamp_at(world, i, from_);
        if lamp.cone.cap > 0.0 {
            chosen = lamp.cone;
            if pick < lamp.weight {
                across = pick / lamp.weight;
                break;
            }
            pick -= lamp.weight;
        }
    }
    return cone_sample(chosen, vec2f(across, u.y));
}

// See CapturedWorld::sample_light.
fn world_sample_light(world: World, from_: vec3f, u: vec2f) -> LightSample {
    let place = place_in_pano(world, from_);
    let share = lamp_light(world, place, vec3f(0.0)).share;
    if u.x < share {
        let direction = lamps_sample(world, place, vec2f(u.x / share, u.y));
        return LightSample(from_pano(world, direction), true, vec3f(0.0), AT_ANYTHING);
    }
    var sample: SphereSample;
    if LIT {
        sample = sphere_sample(light_table(world), vec2f((u.x - share) / (1.0 - share), u.y));
    }
    if !sample.exists {
        return LightSample(vec3f(0.0), false, vec3f(0.0), AT_INFINITY);
    }
    let inverse = inverse_distance(sample.direction);
    if inverse <= 0.0 {
        return LightSample(from_pano(world, sample.direction), true, vec3f(0.0), AT_INFINITY);
    }
    let goal = world.capture + from_pano(world, sample.direction / inverse);
    let direction = normalized_or(goal - from_, vec3f(0.0));
    return LightSample(direction, any(direction != vec3f(0.0)), goal, AT_SURFACE);
}

