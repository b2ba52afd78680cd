// Rays through the two-level hierarchy: a tree of boxes over instances, whose leaves lead to trees over the triangles of meshes.
// A shader that includes this binds the three arrays at 1, 2 and 3.

struct Node {
    lo: vec3f,
    // First of two children, or first instance or triangle of a leaf.
    first: u32,
    hi: vec3f,
    // Instances or triangles of a leaf; 0 for an inner node.
    count: u32,
}

struct Triangle {
    // A corner, the edges v0 - v1 and v2 - v0, and their cross product.
    v0: vec3f,
    // Index of the face in the mesh.
    face: u32,
    e1: vec3f,
    pad1: u32,
    e2: vec3f,
    pad2: u32,
    ng: vec3f,
    pad3: u32,
}

struct Instance {
    // Rows of the transformation from the world to the mesh.
    x: vec4f,
    y: vec4f,
    z: vec4f,
    // Root of the mesh's tree.
    root: u32,
    // Index in the order in which instances were given.
    index: u32,
    // OPAQUE_KIND, or CLEAR_KIND if it lets light through anywhere.
    kind: u32,
    pad2: u32,
}

@group(0) @binding(1) var<storage, read> nodes: array<Node>;
@group(0) @binding(2) var<storage, read> triangles: array<Triangle>;
@group(0) @binding(3) var<storage, read> instances: array<Instance>;

struct Hit {
    t: f32,
    // Weights of the face's second and third corner.
    u: f32,
    v: f32,
    // NOTHING for a miss.
    instance: u32,
    face: u32,
}

const NOTHING: u32 = 0xffffffffu;
// Whatever instances there are.
const ANY_KIND: u32 = 0xffffffffu;
const MISS: f32 = 3e38;

// A direction's inverse, without infinities: 0 times infinity would be no number.
fn inverse_of(direction: vec3f) -> vec3f {
    let small = abs(direction) < vec3f(1e-30);
    return 1.0 / select(direction, select(vec3f(1e-30), vec3f(-1e-30), direction < vec3f(0.0)), small);
}

// Where a ray enters a node's box; MISS if it does not before `t_max`.
fn entry_of(node: u32, origin: vec3f, inverse: vec3f, t_max: f32) -> f32 {
    let a = (nodes[node].lo - origin) * inverse;
    let b = (nodes[node].hi - origin) * inverse;
    let near = min(a, b);
    let far = max(a, b);
    let enter = max(max(near.x, near.y), max(near.z, 0.0));
    let leave = min(min(far.x, far.y), min(far.z, t_max));
    // Three roundings on either side must not lose a flat box.
    return select(MISS, enter, enter <= leave * 1.0000008);
}

// What is left to visit.
struct Pending {
    nodes: array<u32, DEPTH>,
    entries: array<f32, DEPTH>,
    count: u32,
}

// The next node to visit after an inner one: the nearer child, the farther one left for later.
fn descend(pending: ptr<function, Pending>, node: u32, origin: vec3f, inverse: vec3f, t_max: f32) -> u32 {
    let left = nodes[node].first;
    let a = entry_of(left, origin, inverse, t_max);
    let b = entry_of(left + 1u, origin, inverse, t_max);
    if a >= MISS && b >= MISS {
        return NOTHING;
    }
    let nearer = select(left + 1u, left, a <= b);
    if max(a, b) < MISS {
        (*pending).nodes[(*pending).count] = select(left, left + 1u, a <= b);
        (*pending).entries[(*pending).count] = max(a, b);
        (*pending).count += 1u;
    }
    return nearer;
}

// The next node that was left for later and may still hold something before `t_max`.
fn resume(pending: ptr<function, Pending>, t_max: f32) -> u32 {
    while (*pending).count > 0u {
        (*pending).count -= 1u;
        if (*pending).entries[(*pending).count] <= t_max {
            return (*pending).nodes[(*pending).count];
        }
    }
    return NOTHING;
}

// Möller & Trumbore, as on the CPU, from `t_min` on; a ray through the edge between two faces meets one of them.
fn meet_face(triangle: u32, origin: vec3f, direction: vec3f, t_min: f32, hit: ptr<function, Hit>) -> bool {
    let c = triangles[triangle].v0 - origin;
    let r = cross(direction, c);
    let ng = triangles[triangle].ng;
    let determinant = dot(ng, direction);
    if determinant == 0.0 {
        return false;
    }
    let inverse = 1.0 / determinant;
    let u = dot(r, triangles[triangle].e2) * inverse;
    let v = dot(r, triangles[triangle].e1) * inverse;
    let t = dot(ng, c) * inverse;
    if u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t >= t_min && t <= (*hit).t && is_finite(t) {
        (*hit).t = t;
        (*hit).u = u;
        (*hit).v = v;
        (*hit).face = triangles[triangle].face;
        return true;
    }
    return false;
}

// The nearest face of a mesh from `t_min` on and before the hit so far, or any if `any_hit`; the ray is in the mesh's space.
fn trace_mesh(root: u32, origin: vec3f, direction: vec3f, t_min: f32, any_hit: bool, hit: ptr<function, Hit>) -> bool {
    let inverse = inverse_of(direction);
    var pending: Pending;
    pending.count = 0u;
    var met = false;
    var node = root;
    while node != NOTHING {
        let count = nodes[node].count;
        if count == 0u {
            node = descend(&pending, node, origin, inverse, (*hit).t);
            if node != NOTHING {
                continue;
            }
        } else {
            let first = nodes[node].first;
            for (var i = first; i < first + count; i++) {
                met = meet_face(i, origin, direction, t_min, hit) || met;
            }
            if met && any_hit {
                return true;
            }
        }
        node = resume(&pending, (*hit).t);
    }
    return met;
}

// The nearest face along a ray up to `t_max`, or any if `any_hit`; `root` is the root of the upper tree, NOTHING for none.
fn trace_ray(root: u32, origin: vec3f, direction: vec3f, t_max: f32, any_hit: bool) -> Hit {
    return trace_among(root, origin, direction, 0.0, t_max, any_hit, ANY_KIND);
}

// The same from `t_min` on, of instances of these kinds.
fn trace_among(root: u32, origin: vec3f, direction: vec3f, t_min: f32, t_max: f32, any_hit: bool, kinds: u32) -> Hit {
    var hit = Hit(t_max, 0.0, 0.0, NOTHING, 0u);
    let inverse = inverse_of(direction);
    var pending: Pending;
    pending.count = 0u;
    var node = root;
    while node != NOTHING {
        let count = nodes[node].count;
        if count == 0u {
            node = descend(&pending, node, origin, inverse, hit.t);
            if node != NOTHING {
                continue;
            }
        } else {
            let first = nodes[node].first;
            for (var i = first; i < first + count; i++) {
                let place = instances[i];
                if kinds != ANY_KIND && (kinds & place.kind) == 0u {
                    continue;
                }
                let o = vec4f(origin, 1.0);
                let d = vec4f(direction, 0.0);
                let there = vec3f(dot(place.x, o), dot(place.y, o), dot(place.z, o));
                // Not normalised, so that distances stay those of the world.
                let along = vec3f(dot(place.x, d), dot(place.y, d), dot(place.z, d));
                if trace_mesh(place.root, there, along, t_min, any_hit, &hit) {
                    hit.instance = place.index;
                    if any_hit {
                        return hit;
                    }
                }
            }
        }
        node = resume(&pending, hit.t);
    }
    return hit;
}

