// Any object has a texture.
override TEXTURES: bool = true;

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

fn uv_at(i: u32) -> vec2f {
    return vec2f(number_at(i), number_at(i + 1u));
}

// A coordinate in texels, of one period.
fn texture_fold(t: f32, wrap: u32, n: i32) -> f32 {
    if wrap == CLAMP {
        return clamp(t, 0.0, 1.0) * f32(n) - 0.5;
    }
    let period = select(1.0, 2.0, wrap == MIRROR);
    return (t - period * floor(t / period)) * f32(n) - 0.5;
}

// The column or row that shows at `i`.
fn texture_index(i: i32, wrap: u32, n: i32) -> i32 {
    if wrap == CLAMP {
        return clamp(i, 0, n - 1);
    }
    let period = select(n, 2 * n, wrap == MIRROR);
    let folded = ((i % period) + period) % period;
    return min(folded, select(folded, 2 * n - 1 - folded, wrap == MIRROR));
}

// Bilinear lookup; see pano_core::texture.
fn texture_look(texture: u32, mesh_uv: vec2f) -> vec3f {
    let size = vec2i(i32(word(texture + 1u)), i32(word(texture + 2u)));
    let wrap = vec2u(word(texture + 3u), word(texture + 4u));
    var uv = uv_at(texture + 5u) * mesh_uv.x + uv_at(texture + 7u) * mesh_uv.y + uv_at(texture + 9u);
    if !is_finite(uv.x) || !is_finite(uv.y) {
        uv = vec2f(0.0);
    }
    let at = vec2f(texture_fold(uv.x, wrap.x, size.x), texture_fold(uv.y, wrap.y, size.y));
    let whole = floor(at);
    let fraction = at - whole;
    var sum = vec3f(0.0);
    for (var k = 0; k < 4; k++) {
        let d = vec2i(k % 2, k / 2);
        let x = texture_index(i32(whole.x) + d.x, wrap.x, size.x);
        let y = texture_index(i32(whole.y) + d.y, wrap.y, size.y);
        let texel = word(texture) + 2u * u32(y * size.x + x);
        let weights = select(vec2f(1.0) - fraction, fraction, d == vec2i(1));
        sum += vec3f(unpack2x16unorm(word(texel)), unpack2x16unorm(word(texel + 1u)).x) * (weights.x * weights.y);
    }
    return sum * number_at(texture + 11u);
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
    let m = word(at + 26u) + MATERIAL_WORDS * min(id, word(at + 27u) - 1u);
    s.material.base_color = vec3_at(m);
    s.material.specular_color = vec3_at(m + 4u);
    s.material.specular = number_at(m + 7u);
    s.material.ior = number_at(m + 9u);
    s.material.transmission = number_at(m + 10u);
    s.material.thin = word(m + 11u) != 0u;
    s.material.coat = word(m + 12u);
    var metallic = number_at(m + 3u);
    var roughness = number_at(m + 8u);
    var emissive = vec3_at(m + 17u);
    let uvs = word(at + 25u);
    if TEXTURES {
        var uv = vec2f(0.0);
        var from_ = mat3x2f(vec2f(0.0), vec2f(0.0), vec2f(0.0));
        if uvs != NOTHING {
            for (var k = 0u; k < 3u; k++) {
                from_[k] = uv_at(uvs + 2u * word(indices + 3u * hit.face + k));
            }
            uv = from_ * vec3f(1.0 - hit.u - hit.v, hit.u, hit.v);
        }
        for (var k = 0u; k < 4u; k++) {
            let texture = word(m + 20u + k);
            if texture == NOTHING || (k == 3u && uvs == NOTHING) {
                continue;
            }
            let look = texture_look(texture, uv);
            if k == 0u {
                s.material.base_color *= look;
            } else if k == 1u {
                metallic *= look.z;
                roughness *= look.y;
            } else if k == 2u {
                emissive *= look;
            } else {
                // glTF's tangent frame: where u and -v grow.
                let d1 = from_[1] - from_[0];
                let d2 = from_[2] - from_[0];
                let det = d1.x * d2.y - d1.y * d2.x;
                let t = normalized_or(world_from_mesh * (((b - a) * d2.y - (c - a) * d1.y) / det), vec3f(0.0));
                let u = normalized_or(world_from_mesh * (((b - a) * d2.x - (c - a) * d1.x) / det), vec3f(0.0));
                if abs(det) > 1e-20 && any(t != vec3f(0.0)) && any(u != vec3f(0.0)) {
                    let n = look * 2.0 - 1.0;
                    let scale = number_at(m + 24u);
                    s.normal = normalized_or(t * (n.x * scale) + u * (n.y * scale) + s.normal * n.z, s.normal);
                }
            }
        }
    }
    s.material.metallic = clamp(metallic, 0.0, 1.0);
    s.material.alpha = clamp(roughness * roughness, 0.0, 1.0);
    s.outside = dot(s.geometric, direction) < 0.0;
    s.emission = select(vec3f(0.0), emissive, s.outside);
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
    let ranks = word(tables.objects + OBJECT_WORDS * hit.instance + 28u);
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

