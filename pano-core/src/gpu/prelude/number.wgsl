// Numbers: what is finite, and functions that WGSL leaves too inexact.

// A shader's compiler may assume that there is neither NaN nor infinity, so that comparisons cannot find them: bits can.
fn is_finite(x: f32) -> bool {
    return (bitcast<u32>(x) & 0x7f800000u) != 0x7f800000u;
}

fn is_nan(x: f32) -> bool {
    return (bitcast<u32>(x) & 0x7fffffffu) > 0x7f800000u;
}

fn is_finite3(v: vec3f) -> bool {
    return is_finite(v.x) && is_finite(v.y) && is_finite(v.z);
}

// The CPU adds in f64. Here magnitudes end at LARGEST, whose square is still finite with room for a thousand of them.
fn limited(x: f32) -> f32 {
    return clamp(x, -LARGEST, LARGEST);
}

fn limited3(v: vec3f) -> vec3f {
    return clamp(v, vec3f(-LARGEST), vec3f(LARGEST));
}

// Sine and cosine of an angle in radians to about 1e-7 (for angles up to some hundred turns): polynomials after Cephes' sinf,
// as WGSL allows an error of 2^-11 to its own.
fn sin_cos(angle: f32) -> vec2f {
    let quarter = round(angle * (2.0 / PI));
    // π/2 in three parts, the first two of few bits, so that their products are exact.
    let r = ((angle - quarter * 1.5703125) - quarter * 4.837512969970703125e-4) - quarter * 7.549789948768648e-8;
    let z = r * r;
    let s = r + r * z * (-1.6666654611e-1 + z * (8.3321608736e-3 - z * 1.9515295891e-4));
    let c = 1.0 - 0.5 * z + z * z * (4.166664568298827e-2 + z * (-1.388731625493765e-3 + z * 2.443315711809948e-5));
    switch i32(quarter) & 3 {
        case 0: { return vec2f(s, c); }
        case 1: { return vec2f(c, -s); }
        case 2: { return vec2f(-s, -c); }
        default: { return vec2f(-c, s); }
    }
}

// The angle of the point (x, y) in radians, in [-π, π], to about 2e-7; 0 at the origin. After Cephes' atanf.
fn angle_of(y: f32, x: f32) -> f32 {
    let most = max(abs(x), abs(y));
    if most == 0.0 {
        return 0.0;
    }
    let ratio = min(abs(x), abs(y)) / most;
    // tan(π/8): beyond it the angle is taken from π/4.
    let far = ratio > 0.41421356;
    let t = select(ratio, (ratio - 1.0) / (ratio + 1.0), far);
    let z = t * t;
    let p = (((8.05374449538e-2 * z - 1.38776856032e-1) * z + 1.99777106478e-1) * z - 3.33329491539e-1) * z * t + t;
    var angle = select(p, p + 0.25 * PI, far);
    angle = select(angle, 0.5 * PI - angle, abs(y) > abs(x));
    angle = select(angle, PI - angle, x < 0.0);
    return select(angle, -angle, y < 0.0);
}

// sqrt(x² + y²) without squares that are too small or too large.
fn hypotenuse(x: f32, y: f32) -> f32 {
    let most = max(abs(x), abs(y));
    if most == 0.0 {
        return 0.0;
    }
    let ratio = min(abs(x), abs(y)) / most;
    return most * sqrt(1.0 + ratio * ratio);
}

