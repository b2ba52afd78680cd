// Known real geometry under an environment at infinity; see world/proxy.rs. Comes after environment.wgsl, in shaders whose uniform has
// `World`.

// Any proxy is a mesh; the reflectance of any is read off the picture.
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
    return reflectance_from(radiance, received, cap);
}

fn world_matter(world: World, hit: RealHit) -> Matter {
    return Matter(world_reflectance(world, hit), vec3f(0.0));
}

fn world_sample_light(world: World, from_: vec3f, u: vec2f) -> LightSample {
    let sample = environment_sample(world, u);
    return LightSample(sample.direction, sample.exists, vec3f(0.0), AT_INFINITY);
}

// Where a ray that leaves a real surface starts.
fn world_leave(world: World, hit: RealHit) -> vec3f {
    return offset_point(hit.position, hit.normal) + hit.normal * (hit.t * 2e-6);
}

// What is at a pixel's centre.
fn guides_at(center: vec2f) -> Guides {
    let d = camera_direction(center);
    let object = trace_ray(params.view.roots.x, params.view.position, d, NEVER, false);
    return guides_of(object, world_hit(params.world, params.view.roots.y, params.view.position, d, object.t), d);
}

// What lies on a ray. Where nothing real does, its light is known.
fn answer_to(quest: Quest) -> Answer {
    var answer: Answer;
    answer.object = Hit(quest.limit, 0.0, 0.0, NOTHING, 0u);
    if (quest.asks & FOR_OBJECTS) != 0u {
        let any = (quest.asks & FOR_ANY) != 0u;
        answer.object = trace_ray(params.view.roots.x, quest.origin, quest.direction, quest.limit, any);
    }
    answer.asked = asks_world(quest.asks, answer.object.instance != NOTHING);
    if answer.asked {
        let t_max = select(answer.object.t, NEVER, (quest.asks & BEHIND_OBJECTS) != 0u);
        answer.real = world_hit(params.world, params.view.roots.y, quest.origin, quest.direction, t_max);
    }
    answer.known = answer.asked && !answer.real.exists;
    return answer;
}
