// The equirectangular picture as a sphere of directions; see pano_core::sphere.

fn direction_from_uv(uv: vec2f) -> vec3f {
    let l = sin_cos((uv.x - 0.5) * TAU);
    let t = sin_cos(uv.y * PI);
    return vec3f(t.x * l.x, t.y, -t.x * l.y);
}

fn uv_from_direction(d: vec3f) -> vec2f {
    let horizontal = hypotenuse(d.x, d.z);
    let v = angle_of(horizontal, d.y) / PI;
    let u = select(0.5 + angle_of(d.x, -d.z) / TAU, 0.5, horizontal == 0.0);
    return vec2f(select(u, u - 1.0, u >= 1.0), v);
}

// Column x and row y, both possibly outside, as a texel of the sphere.
fn wrap_texel(size: vec2i, x: i32, y: i32) -> vec2i {
    var texel = vec2i(x, y);
    if y < 0 {
        texel = vec2i(x + size.x / 2, -1 - y);
    } else if y >= size.y {
        texel = vec2i(x + size.x / 2, 2 * size.y - 1 - y);
    }
    // The remainder of a negative number is negative.
    let column = ((texel.x % size.x) + size.x) % size.x;
    return vec2i(column, clamp(texel.y, 0, size.y - 1));
}

// Where a bilinear lookup at (u, v) begins: the upper left texel, and the weights of the right and the lower ones.
struct Footprint {
    texel: vec2i,
    fraction: vec2f,
}

fn footprint(size: vec2i, uv: vec2f) -> Footprint {
    let at = vec2f(uv.x, clamp(uv.y, 0.0, 1.0)) * vec2f(size) - 0.5;
    let whole = floor(at);
    return Footprint(vec2i(whole), at - whole);
}

// One of the four texels of a bilinear lookup, and its weight.
struct Tap {
    texel: vec2i,
    weight: f32,
}

fn tap_of(size: vec2i, at: Footprint, i: i32) -> Tap {
    let d = vec2i(i % 2, i / 2);
    let shares = select(vec2f(1.0) - at.fraction, at.fraction, d == vec2i(1));
    return Tap(wrap_texel(size, at.texel.x + d.x, at.texel.y + d.y), shares.x * shares.y);
}

