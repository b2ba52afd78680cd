// What worlds have in common: the panorama as light from infinity, hits, light samples; see world/mod.rs. A shader that includes this
// binds `pictures`, of which the panorama is the first, and declares `World` with its frame and its table of light.

// The panorama is not black.
override LIT: bool = true;

struct RealHit {
    position: vec3f,
    t: f32,
    normal: vec3f,
    surface: u32,
    // That leaves towards the ray's origin, where the world knows it.
    radiance: vec3f,
    exists: bool,
}

// What a surface is made of: its diffuse reflectance, and the radiance beyond what the largest one could send out.
struct Matter {
    reflectance: vec3f,
    beyond: vec3f,
}

// A direction in which light may come. It counts if what it is aimed at lies there: infinity, the surface at `goal`, whatever it is.
struct LightSample {
    direction: vec3f,
    exists: bool,
    goal: vec3f,
    aimed: u32,
}

const AT_INFINITY: u32 = 0u;
const AT_SURFACE: u32 = 1u;

fn texel_at(begin: u32, size: vec2u, texel: vec2i) -> vec3f {
    let k = begin + 3u * (u32(texel.y) * size.x + u32(texel.x));
    return vec3f(pictures[k], pictures[k + 1u], pictures[k + 2u]);
}

fn picture_at(begin: u32, size: vec2u, uv: vec2f) -> vec3f {
    let at = footprint(vec2i(size), uv);
    var sum = vec3f(0.0);
    for (var i = 0; i < 4; i++) {
        let tap = tap_of(vec2i(size), at, i);
        sum += texel_at(begin, size, tap.texel) * tap.weight;
    }
    return sum;
}

fn to_pano(world: World, d: vec3f) -> vec3f {
    return world.pano_x * d.x + world.pano_y * d.y + world.pano_z * d.z;
}

fn from_pano(world: World, d: vec3f) -> vec3f {
    return vec3f(dot(world.pano_x, d), dot(world.pano_y, d), dot(world.pano_z, d));
}

fn environment_look(world: World, d: vec3f) -> vec3f {
    return picture_at(0u, world.size, uv_from_direction(to_pano(world, d)));
}

fn light_table(world: World) -> SphereTable {
    return SphereTable(world.light, vec2i(world.light_size));
}

fn environment_pdf(world: World, d: vec3f) -> f32 {
    if !LIT {
        return 0.0;
    }
    return sphere_pdf(light_table(world), to_pano(world, d));
}

fn environment_sample(world: World, u: vec2f) -> SphereSample {
    var sample: SphereSample;
    if LIT {
        sample = sphere_sample(light_table(world), u);
        sample.direction = from_pano(world, sample.direction);
    }
    return sample;
}

// See proxy::reflectance_from.
fn reflectance_from(radiance: vec3f, received: vec3f, cap: f32) -> vec3f {
    let rho = clamp(PI * radiance / max(received, vec3f(1e-37)), vec3f(0.0), vec3f(cap));
    return select(vec3f(0.0), rho, received > vec3f(0.0));
}

// Moves a surface point off its surface; see bvh/mod.rs.
fn offset_coordinate(p: f32, n: f32) -> f32 {
    if abs(p) < 1.0 / 32.0 {
        return p + n / 65536.0;
    }
    let steps = i32(256.0 * n);
    return bitcast<f32>(bitcast<i32>(p) + select(steps, -steps, p < 0.0));
}

fn offset_point(p: vec3f, n: vec3f) -> vec3f {
    return vec3f(offset_coordinate(p.x, n.x), offset_coordinate(p.y, n.y), offset_coordinate(p.z, n.z));
}

