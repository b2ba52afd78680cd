// Tabulated distributions; see pano_core::distribution.

// The first of `count` entries whose cumulative probability ends beyond `u`.
fn distribution_find(cdf: u32, count: u32, u: f32) -> u32 {
    var lo = 0u;
    var hi = count - 1u;
    while lo < hi {
        let middle = (lo + hi) / 2u;
        if number_at(cdf + middle + 1u) > u {
            hi = middle;
        } else {
            lo = middle + 1u;
        }
    }
    return lo;
}

// Where inside the share of entry `i` the number `u` fell, in [0, 1).
fn distribution_rest(cdf: u32, i: u32, u: f32) -> f32 {
    let from_ = number_at(cdf + i);
    return clamp((u - from_) / (number_at(cdf + i + 1u) - from_), 0.0, BELOW_ONE);
}

// Inverts the CDF of the density on [0, 1] that goes linearly from `a` to `b`.
fn sample_linear(u: f32, a: f32, b: f32) -> f32 {
    if a + b <= 0.0 {
        return u;
    }
    let root = sqrt(max(a * a + (b * b - a * a) * u, 0.0));
    if a + root <= 0.0 {
        return 0.0;
    }
    return clamp(u * (a + b) / (a + root), 0.0, 1.0);
}

// A distribution over the sphere: where its tables begin, and the size of its picture.
struct SphereTable {
    at: u32,
    size: vec2i,
}

fn sphere_luminance(table: SphereTable, x: i32, y: i32) -> f32 {
    let texel = wrap_texel(table.size, x, y);
    return number_at(table.at + u32(texel.y * table.size.x + texel.x));
}

fn sphere_row_factor(table: SphereTable, row: u32) -> f32 {
    return number_at(table.at + u32(table.size.x * table.size.y) + row);
}

struct SphereSample {
    direction: vec3f,
    exists: bool,
}

fn sphere_sample(table: SphereTable, u: vec2f) -> SphereSample {
    var sample: SphereSample;
    let w = u32(table.size.x);
    let h = u32(table.size.y);
    let rows = table.at + w * h + h + 1u;
    let row = distribution_find(rows, h + 1u, u.y);
    let v = distribution_rest(rows, row, u.y);
    let columns = rows + h + 2u + row * (w + 1u);
    if number_at(columns + w) == 0.0 {
        return sample;
    }
    let column = distribution_find(columns, w, u.x);
    let s = distribution_rest(columns, column, u.x);
    let x = i32(column);
    let y = i32(row);
    var a = sphere_luminance(table, x, y - 1);
    var b = sphere_luminance(table, x + 1, y - 1);
    var c = sphere_luminance(table, x, y);
    var d = sphere_luminance(table, x + 1, y);
    // The cells at the poles are cut in half.
    if row == 0u {
        a = 0.5 * (a + c);
        b = 0.5 * (b + d);
    } else if row == h {
        c = 0.5 * (a + c);
        d = 0.5 * (b + d);
    }
    let fv = sample_linear(v, a + b, c + d);
    let fs = sample_linear(s, a + (c - a) * fv, b + (d - b) * fv);
    let top = clamp((f32(row) - 0.5) / f32(h), 0.0, 1.0);
    let bottom = clamp((f32(row) + 0.5) / f32(h), 0.0, 1.0);
    let luminous = mix(mix(a, b, fs), mix(c, d, fs), fv);
    sample.direction = direction_from_uv(vec2f((f32(x) + 0.5 + fs) / f32(w), top + (bottom - top) * fv));
    sample.exists = luminous * sphere_row_factor(table, row) > 0.0;
    return sample;
}

// Density per steradian of unit `d`.
fn sphere_pdf(table: SphereTable, d: vec3f) -> f32 {
    let uv = uv_from_direction(d);
    let row = min(u32(uv.y * f32(table.size.y) + 0.5), u32(table.size.y));
    let at = footprint(table.size, uv);
    let upper = mix(sphere_luminance(table, at.texel.x, at.texel.y), sphere_luminance(table, at.texel.x + 1, at.texel.y), at.fraction.x);
    let below = at.texel.y + 1;
    let lower = mix(sphere_luminance(table, at.texel.x, below), sphere_luminance(table, at.texel.x + 1, below), at.fraction.x);
    return mix(upper, lower, at.fraction.y) * sphere_row_factor(table, row) / max(hypotenuse(d.x, d.z), MIN_SIN);
}

