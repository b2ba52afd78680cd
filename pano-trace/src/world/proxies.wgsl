// Known real geometry under an environment at infinity; see world/proxy.rs. A shader that includes this binds `pictures` and gives
// the uniform's part `World`.

// The panorama is not black; any proxy is a mesh; the reflectance of any is read off the picture.
override LIT: bool = true;
override PROXY_MESHES: bool = true;
override FROM_PICTURE: bool = true;

struct World {
    // Columns of the turn from the world into the panorama's frame.
    pano_x: vec3f,
    rectangles: u32,
    pano_y: vec3f,
    rectangle_count: u32,
    pano_z: vec3f,
    placed: u32,
    capture: vec3f,
    reflectances: u32,
    light_size: vec2u,
    light: u32,
    // Where the irradiance by normal begins among the pictures, of which the environment is the first.
    irradiance: u32,
    size: vec2u,
    irradiance_size: vec2u,
}

struct RealHit {
    position: vec3f,
    t: f32,
    normal: vec3f,
    surface: u32,
    exists: bool,
}

fn picture_at(begin: u32, size: vec2u, uv: vec2f) -> vec3f {
    let at = footprint(vec2i(size), uv);
    var sum = vec3f(0.0);
    for (var i = 0; i < 4; i++) {
        let d = vec2i(i % 2, i / 2);
        let texel = wrap_texel(vec2i(size), at.texel.x + d.x, at.texel.y + d.y);
        let weights = select(vec2f(1.0) - at.fraction, at.fraction, d == vec2i(1));
        let k = begin + 3u * (u32(texel.y) * size.x + u32(texel.x));
        sum += vec3f(pictures[k], pictures[k + 1u], pictures[k + 2u]) * (weights.x * weights.y);
    }
    return sum;
}

fn to_pano(world: World, d: vec3f) -> vec3f {
    return world.pano_x * d.x + world.pano_y * d.y + world.pano_z * d.z;
}

fn environment_look(world: World, d: vec3f) -> vec3f {
    return picture_at(0u, world.size, uv_from_direction(to_pano(world, d)));
}

fn environment_pdf(world: World, d: vec3f) -> f32 {
    if !LIT {
        return 0.0;
    }
    return sphere_pdf(SphereTable(world.light, vec2i(world.light_size)), to_pano(world, d));
}

fn environment_sample(world: World, u: vec2f) -> SphereSample {
    var sample: SphereSample;
    if LIT {
        sample = sphere_sample(SphereTable(world.light, vec2i(world.light_size)), u);
        let d = sample.direction;
        sample.direction = vec3f(dot(world.pano_x, d), dot(world.pano_y, d), dot(world.pano_z, d));
    }
    return sample;
}

// The nearest proxy before `t_max`; `root` is that of the tree over meshes.
fn world_hit(world: World, root: u32, origin: vec3f, direction: vec3f, t_max: f32) -> RealHit {
    var hit: RealHit;
    hit.t = t_max;
    for (var i = 0u; i < world.rectangle_count; i++) {
        let at = world.rectangles + RECTANGLE_WORDS * i;
        let turn = matrix_at(at);
        let o = turn * origin + vec3_at(at + 9u);
        let d = turn * direction;
        if d.y == 0.0 {
            continue;
        }
        let t = -o.y / d.y;
        let p = abs(vec2f(o.x + t * d.x, o.z + t * d.z));
        if t > 0.0 && t < hit.t && p.x <= number_at(at + 15u) && p.y <= number_at(at + 16u) {
            hit.t = t;
            hit.normal = vec3_at(at + 12u);
            hit.surface = word(at + 17u);
            hit.exists = true;
        }
    }
    if PROXY_MESHES {
        let met = trace_ray(root, origin, direction, hit.t, false);
        if met.instance != NOTHING {
            let at = world.placed + PLACED_WORDS * met.instance;
            let turn = matrix_at(at);
            let indices = word(at + 12u);
            let positions = word(at + 13u);
            let a = turn * face_corner(indices, positions, met.face, 0u);
            let b = turn * face_corner(indices, positions, met.face, 1u);
            let c = turn * face_corner(indices, positions, met.face, 2u);
            hit.t = met.t;
            hit.normal = normalized_or(cross(b - a, c - a), -direction);
            hit.surface = word(at + 14u);
            hit.exists = true;
        }
    }
    hit.normal = select(hit.normal, -hit.normal, dot(hit.normal, direction) > 0.0);
    hit.position = origin + direction * hit.t;
    return hit;
}

fn world_reflectance(world: World, hit: RealHit) -> vec3f {
    let at = world.reflectances + REFLECTANCE_WORDS * hit.surface;
    let cap = number_at(at);
    if !FROM_PICTURE || cap < 0.0 {
        return vec3_at(at + 1u);
    }
    let radiance = environment_look(world, hit.position - world.capture);
    let uv = uv_from_direction(to_pano(world, hit.normal));
    let received = picture_at(world.irradiance, world.irradiance_size, uv);
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

// Where a ray that leaves a real surface starts.
fn world_leave(hit: RealHit) -> vec3f {
    return offset_point(hit.position, hit.normal) + hit.normal * (hit.t * 2e-6);
}

