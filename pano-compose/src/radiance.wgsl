// What a radiance can be; NaN becomes 0.
fn to_radiance(v: f32) -> f32 {
    let most = 3.4028234663852886e38f;
    return select(select(0.0, min(v, most), v > 0.0), 0.0, is_nan(v));
}

