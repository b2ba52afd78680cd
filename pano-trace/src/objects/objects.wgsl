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

// Where the material of the face that was met begins in the tables.
fn material_of(tables: ObjectTables, hit: Hit) -> u32 {
    let at = tables.objects + OBJECT_WORDS * hit.instance;
    let ids = word(at + 24u);
    var id = 0u;
    if ids != NOTHING {
        id = word(ids + hit.face);
    }
    return word(at + 26u) + MATERIAL_WORDS * min(id, word(at + 27u) - 1u);
}

// A face that was met.
struct Face {
    world_from_mesh: mat3x3f,
    world_from_normal: mat3x3f,
    // Of its mesh.
    corners: mat3x3f,
    // Where the tables of its mesh begin.
    indices: u32,
    normals: u32,
    uvs: u32,
    // Unit normals: the face's, and where its corners have some, the mean of theirs.
    geometric: vec3f,
    normal: vec3f,
}

// The face that a ray along `direction` met.
fn face_at(tables: ObjectTables, hit: Hit, direction: vec3f) -> Face {
    let at = tables.objects + OBJECT_WORDS * hit.instance;
    let positions = word(at + 22u);
    var f: Face;
    f.world_from_mesh = matrix_at(at);
    f.world_from_normal = matrix_at(at + 12u);
    f.indices = word(at + 21u);
    f.normals = word(at + 23u);
    f.uvs = word(at + 25u);
    let a = face_corner(f.indices, positions, hit.face, 0u);
    let b = face_corner(f.indices, positions, hit.face, 1u);
    let c = face_corner(f.indices, positions, hit.face, 2u);
    f.corners = mat3x3f(a, b, c);
    f.geometric = normalized_or(f.world_from_normal * cross(b - a, c - a), -direction);
    f.normal = f.geometric;
    if f.normals != NOTHING {
        let own = normals_of(f, hit.face);
        let n = normalized_or(f.world_from_normal * interpolated(own[0], own[1], own[2], hit.u, hit.v), f.geometric);
        f.normal = select(n, -n, dot(n, f.geometric) < 0.0);
    }
    return f;
}

// The normals of a face's corners, in the mesh's space.
fn normals_of(f: Face, face: u32) -> mat3x3f {
    let a = face_corner(f.indices, f.normals, face, 0u);
    let b = face_corner(f.indices, f.normals, face, 1u);
    let c = face_corner(f.indices, f.normals, face, 2u);
    return mat3x3f(a, b, c);
}

// The texture coordinates of a face's corners; 0 where it has none.
fn uvs_of(f: Face, face: u32) -> mat3x2f {
    var uvs = mat3x2f(vec2f(0.0), vec2f(0.0), vec2f(0.0));
    if f.uvs != NOTHING {
        for (var k = 0u; k < 3u; k++) {
            uvs[k] = uv_at(f.uvs + 2u * word(f.indices + 3u * face + k));
        }
    }
    return uvs;
}

// The surface that a ray along `direction` met.
fn surface_at(tables: ObjectTables, hit: Hit, direction: vec3f) -> Surface {
    return surface_of(tables, face_at(tables, hit, direction), hit, direction, point_area());
}

// The same of a face, its textures averaged over a footprint.
fn surface_of(tables: ObjectTables, f: Face, hit: Hit, direction: vec3f, footprint: TextureArea) -> Surface {
    let at = tables.objects + OBJECT_WORDS * hit.instance;
    let a = f.corners[0];
    let b = f.corners[1];
    let c = f.corners[2];
    var s: Surface;
    s.position = f.world_from_mesh * interpolated(a, b, c, hit.u, hit.v) + vec3_at(at + 9u);
    s.geometric = f.geometric;
    s.normal = f.normal;
    let m = material_of(tables, hit);
    s.material.base_color = vec3_at(m);
    s.material.specular_color = vec3_at(m + 4u);
    s.material.specular = number_at(m + 7u);
    s.material.ior = number_at(m + IOR_WORD);
    s.material.transmission = number_at(m + 10u);
    s.material.thin = word(m + 11u) != 0u;
    s.material.coat = word(m + 12u);
    var metallic = number_at(m + 3u);
    var roughness = number_at(m + 8u);
    var emissive = vec3_at(m + 17u);
    if TEXTURES {
        let from_ = uvs_of(f, hit.face);
        let uv = from_ * vec3f(1.0 - hit.u - hit.v, hit.u, hit.v);
        for (var k = 0u; k < 4u; k++) {
            let texture = word(m + 20u + k);
            if texture == NOTHING || (k == 3u && f.uvs == NOTHING) {
                continue;
            }
            let look = texture_look(texture, uv, footprint);
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
                let t = normalized_or(f.world_from_mesh * (((b - a) * d2.y - (c - a) * d1.y) / det), vec3f(0.0));
                let u = normalized_or(f.world_from_mesh * (((b - a) * d2.x - (c - a) * d1.x) / det), vec3f(0.0));
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
    let distance = number_at(m + ABSORPTION_WORD + 3u);
    if BODIES && !s.outside && s.material.transmission > 0.0 && !s.material.thin && distance > 0.0 {
        s.transmittance = transmittance_of(vec3_at(m + ABSORPTION_WORD), distance, hit.t);
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

