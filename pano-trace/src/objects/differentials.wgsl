// Ray differentials: how a ray changes across its pixel, and so what it covers of a surface; see differentials.rs and surface.rs.

// How a ray's origin and unit direction change along x and along y of the picture.
struct Beam {
    origin_x: vec3f,
    pad0: u32,
    origin_y: vec3f,
    pad1: u32,
    direction_x: vec3f,
    pad2: u32,
    direction_y: vec3f,
    pad3: u32,
}

// The same of a point where it meets a surface.
struct Neighbours {
    position: mat2x3f,
    normal: mat2x3f,
    direction: mat2x3f,
}

fn beam_of(origin: mat2x3f, direction: mat2x3f) -> Beam {
    return Beam(origin[0], 0u, origin[1], 0u, direction[0], 0u, direction[1], 0u);
}

// Along the surface with unit `normal`, which a ray along `direction` meets at `t`.
fn moved_on_plane(moved: vec3f, direction: vec3f, normal: vec3f) -> vec3f {
    let cosine = dot(direction, normal);
    let least = copy_sign(LEAST_COSINE, cosine);
    return moved - direction * (dot(moved, normal) / select(cosine, least, abs(cosine) < LEAST_COSINE));
}

// Where a ray along `direction` meets a plane.
fn neighbours_on_plane(beam: Beam, direction: vec3f, t: f32, normal: vec3f) -> Neighbours {
    let x = moved_on_plane(beam.origin_x + beam.direction_x * t, direction, normal);
    let y = moved_on_plane(beam.origin_y + beam.direction_y * t, direction, normal);
    let still = mat2x3f(vec3f(0.0), vec3f(0.0));
    return Neighbours(mat2x3f(x, y), still, mat2x3f(beam.direction_x, beam.direction_y));
}

fn reflected_change(change: vec3f, turn: vec3f, direction: vec3f, normal: vec3f) -> vec3f {
    let along = dot(change, normal) + dot(direction, turn);
    return change - (normal * along + turn * dot(direction, normal)) * 2.0;
}

// Of the mirror image of unit `direction`.
fn reflected_beam(n: Neighbours, direction: vec3f, normal: vec3f) -> Beam {
    let x = reflected_change(n.direction[0], n.normal[0], direction, normal);
    return beam_of(n.position, mat2x3f(x, reflected_change(n.direction[1], n.normal[1], direction, normal)));
}

fn refracted_change(change: vec3f, turn: vec3f, direction: vec3f, normal: vec3f, eta: f32) -> vec3f {
    let cosine = -dot(direction, normal);
    let behind = max(sqrt(max(1.0 - (1.0 - cosine * cosine) / (eta * eta), 0.0)), LEAST_COSINE);
    let along = -(dot(change, normal) + dot(direction, turn));
    let normal_part = along / eta - cosine * along / (eta * eta * behind);
    return change / eta + turn * (cosine / eta - behind) + normal * normal_part;
}

// Of unit `direction` refracted.
fn refracted_beam(n: Neighbours, direction: vec3f, normal: vec3f, eta: f32) -> Beam {
    let x = refracted_change(n.direction[0], n.normal[0], direction, normal, eta);
    return beam_of(n.position, mat2x3f(x, refracted_change(n.direction[1], n.normal[1], direction, normal, eta)));
}

// Of unit `direction` in a lobe that is at least `spread` wide, radians.
fn scattered_beam(n: Neighbours, direction: vec3f, spread: f32) -> Beam {
    return beam_of(n.position, mat2x3f(tangent_of(direction) * spread, bitangent_of(direction) * spread));
}

// What the beam of a ray along `direction` covers of a face: how position and normal change, and what that covers of its textures.
struct Covered {
    neighbours: Neighbours,
    footprint: TextureArea,
}

fn covered_by(beam: Beam, f: Face, hit: Hit, direction: vec3f, most: u32) -> Covered {
    var covered = Covered(neighbours_on_plane(beam, direction, hit.t, f.geometric), point_area());
    let e = f.world_from_mesh * (f.corners[1] - f.corners[0]);
    let g = f.world_from_mesh * (f.corners[2] - f.corners[0]);
    let ee = dot(e, e);
    let eg = dot(e, g);
    let gg = dot(g, g);
    let det = ee * gg - eg * eg;
    let uvs = uvs_of(f, hit.face);
    var weights = mat2x2f(vec2f(0.0), vec2f(0.0));
    for (var i = 0u; i < 2u; i++) {
        let along = vec2f(dot(e, covered.neighbours.position[i]), dot(g, covered.neighbours.position[i]));
        weights[i] = vec2f(gg * along.x - eg * along.y, ee * along.y - eg * along.x) / det;
        if !is_finite(weights[i].x) || !is_finite(weights[i].y) {
            return covered;
        }
    }
    if f.normals != NOTHING {
        let own = f.world_from_normal * normals_of(f, hit.face);
        let mean = interpolated(own[0], own[1], own[2], hit.u, hit.v);
        let side = select(1.0, -1.0, dot(mean, f.normal) < 0.0);
        for (var i = 0u; i < 2u; i++) {
            let change = ((own[1] - own[0]) * weights[i].x + (own[2] - own[0]) * weights[i].y) * side;
            let turned = (change - f.normal * dot(change, f.normal)) / length(mean);
            covered.neighbours.normal[i] = select(vec3f(0.0), turned, is_finite3(turned));
        }
    }
    if f.uvs != NOTHING {
        let x = (uvs[1] - uvs[0]) * weights[0].x + (uvs[2] - uvs[0]) * weights[0].y;
        let y = (uvs[1] - uvs[0]) * weights[1].x + (uvs[2] - uvs[0]) * weights[1].y;
        covered.footprint = TextureArea(x, y, most);
    }
    return covered;
}
