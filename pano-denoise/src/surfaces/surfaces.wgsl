// What is seen at each pixel, as edge-stopping filters compare it: tangent planes in inverse depth, and normals. A filter that
// includes this has `depth` and `normal` among its `params`: inverses of the sigmas, 0 for none.

@group(0) @binding(3) var<storage, read> slope: array<f32>;
@group(0) @binding(4) var<storage, read> normal: array<f32>;

// -ln of a weight that counts as none: that of the smallest f64 above 0, so that the CPU agrees.
const FAR: f32 = 745.0;

// A square of a ratio that is 0 for the smallest and FAR for the largest values.
fn far_square(x: f32) -> f32 {
    let ratio = min(abs(x), 1e3);
    return ratio * ratio;
}

// A vector of any length > 0 scaled so that its square is neither too large nor too small; zero stays zero.
fn scaled(v: vec3f) -> vec3f {
    return v / max(max(abs(v.x), max(abs(v.y), abs(v.z))), 1e-37);
}

fn slope_at(i: u32) -> vec3f {
    return vec3f(slope[3u * i], slope[3u * i + 1u], slope[3u * i + 2u]);
}

fn normal_at(i: u32) -> vec3f {
    return vec3f(normal[3u * i], normal[3u * i + 1u], normal[3u * i + 2u]);
}

// -ln of the weight of a tap, `offset` away from the pixel: each must lie in the other's tangent plane, and their normals must
// agree. Slopes are inverse depth and its change to the right and down; sigmas are given as inverses, 0 for none.
fn surface_exponent(a: vec3f, b: vec3f, n: vec3f, m: vec3f, offset: vec2i, over_pole: bool, depth: f32, normal: f32) -> f32 {
    let nearer = max(a.x, b.x);
    var exponent = 0.0;
    if nearer > 0.0 {
        let d = vec2f(offset);
        let forward = a.x + a.y * d.x + a.z * d.y - b.x;
        // Seen from the tap, the pixel lies the other way; beyond a pole rows run backwards, so that "up" stays "up".
        let backward = b.x - b.y * d.x + b.z * select(-d.y, d.y, over_pole) - a.x;
        exponent += 0.5 * far_square(max(abs(forward), abs(backward)) / nearer * depth);
    }
    if normal > 0.0 {
        if !is_finite3(n) || !is_finite3(m) {
            return FAR;
        }
        let u = scaled(n);
        let v = scaled(m);
        if any(u != vec3f(0.0)) && any(v != vec3f(0.0)) {
            // 1 - cos φ is about φ²/2. No `normalize`: it is good to 1e-4 only on some GPUs.
            exponent += min(max(1.0 - dot(u, v) / sqrt(dot(u, u) * dot(v, v)), 0.0) * normal * normal, FAR);
        } else if any(n != m) {
            return FAR;
        }
    }
    return exponent;
}

// The same of the tap `q` for the pixel `p`.
fn exponent_at(p: u32, q: u32, offset: vec2i, over_pole: bool) -> f32 {
    return surface_exponent(
        slope_at(p), slope_at(q), normal_at(p), normal_at(q), offset, over_pole, params.depth, params.normal,
    );
}
