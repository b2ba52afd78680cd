// What a hit on an object means: position, normals, material, light of its own; see objects/surface.rs and emitters.rs. A shader
// that includes this says in `tables` where the tables begin.

// Where the packed tables begin.
struct ObjectTables {
    objects: u32,
    emitters: u32,
    emitter_count: u32,
}

fn table_value(i: u32) -> f32 {
    return number_at(i);
}

fn face_corner(indices: u32, positions: u32, face: u32, corner: u32) -> vec3f {
    return vec3_at(positions + 3u * word(indices + 3u * face + corner));
}

// Barycentric mean of per-vertex vectors.
fn interpolated(a: vec3f, b: vec3f, c: vec3f, u: f32, v: f32) -> vec3f {
    return a * (1.0 - u - v) + b * u + c * v;
}

struct Surface {
    position: vec3f,
    outside: bool,
    geometric: vec3f,
    normal: vec3f,
    material: Material,
    emission: vec3f,
    transmittance: vec3f,
}

// What is left of light after `t` metres of a body.
fn transmittance_of(color: vec3f, distance: f32, t: f32) -> vec3f {
    let by = t / distance;
    // Exactly nothing of a channel that is taken away.
    return select(pow(color, vec3f(by)), vec3f(0.0), color <= vec3f(0.0));
}

// The surface that a ray along `direction` met.
fn surface_at(tables: ObjectTables, hit: Hit, direction: vec3f) -> Surface {
    let at = tables.objects + OBJECT_WORDS * hit.instance;
    let world_from_mesh = matrix_at(at);
    let world_from_normal = matrix_at(at + 12u);
    let indices = word(at + 21u);
    let positions = word(at + 22u);
    let normals = word(at + 23u);
    let ids = word(at + 24u);
    let a = face_corner(indices, positions, hit.face, 0u);
    let b = face_corner(indices, positions, hit.face, 1u);
    let c = face_corner(indices, positions, hit.face, 2u);
    var s: Surface;
    s.position = world_from_mesh * interpolated(a, b, c, hit.u, hit.v) + vec3_at(at + 9u);
    s.geometric = normalized_or(world_from_normal * cross(b - a, c - a), -direction);
    s.normal = s.geometric;
    if normals != NOTHING {
        let na = face_corner(indices, normals, hit.face, 0u);
        let nb = face_corner(indices, normals, hit.face, 1u);
        let nc = face_corner(indices, normals, hit.face, 2u);
        let n = normalized_or(world_from_normal * interpolated(na, nb, nc, hit.u, hit.v), s.geometric);
        s.normal = select(n, -n, dot(n, s.geometric) < 0.0);
    }
    var id = 0u;
    if ids != NOTHING {
        id = word(ids + hit.face);
    }
    let m = word(at + 25u) + MATERIAL_WORDS * min(id, word(at + 26u) - 1u);
    s.material.base_color = vec3_at(m);
    s.material.metallic = number_at(m + 3u);
    s.material.specular_color = vec3_at(m + 4u);
    s.material.specular = number_at(m + 7u);
    s.material.alpha = number_at(m + 8u);
    s.material.ior = number_at(m + 9u);
    s.material.transmission = number_at(m + 10u);
    s.material.thin = word(m + 11u) != 0u;
    s.material.coat = word(m + 12u);
    s.outside = dot(s.geometric, direction) < 0.0;
    s.emission = select(vec3f(0.0), vec3_at(m + 17u), s.outside);
    s.transmittance = vec3f(1.0);
    let distance = number_at(m + 16u);
    if BODIES && !s.outside && s.material.transmission > 0.0 && !s.material.thin && distance > 0.0 {
        s.transmittance = transmittance_of(vec3_at(m + 13u), distance, hit.t);
    }
    return s;
}

struct EmitterSample {
    point: vec3f,
    exists: bool,
    direction: vec3f,
}

// A point on a shining face, seen from `at`.
fn emitter_sample(tables: ObjectTables, at: vec3f, u: vec4f) -> EmitterSample {
    var sample: EmitterSample;
    let i = distribution_find(tables.emitters, tables.emitter_count, u.z);
    let face = tables.emitters + tables.emitter_count + 1u + EMITTER_WORDS * i;
    let root = sqrt(u.x);
    sample.point = vec3_at(face) + vec3_at(face + 3u) * (root * (1.0 - u.y)) + vec3_at(face + 6u) * (root * u.y);
    let to = sample.point - at;
    sample.direction = to / length(to);
    sample.exists = -dot(vec3_at(face + 9u), sample.direction) > 1e-6 && is_finite3(sample.direction);
    return sample;
}

// Density per steradian with which `emitter_sample` finds the point that a ray along `direction` has hit.
fn emitter_pdf(tables: ObjectTables, hit: Hit, direction: vec3f) -> f32 {
    let ranks = word(tables.objects + OBJECT_WORDS * hit.instance + 27u);
    if ranks == NOTHING {
        return 0.0;
    }
    let i = word(ranks + hit.face);
    if i == NOTHING {
        return 0.0;
    }
    let face = tables.emitters + tables.emitter_count + 1u + EMITTER_WORDS * i;
    let cosine = -dot(vec3_at(face + 9u), direction);
    if cosine <= 1e-6 {
        return 0.0;
    }
    return number_at(face + 13u) / number_at(face + 12u) * hit.t * hit.t / cosine;
}

