// Surfaces and their base colour, as edge-stopping filters compare them. A filter that includes this has `albedo` among its
// `params` as well: the inverse of the sigma, 0 for none.

@group(0) @binding(5) var<storage, read> albedo: array<f32>;

fn albedo_at(i: u32) -> vec3f {
    return vec3f(albedo[3u * i], albedo[3u * i + 1u], albedo[3u * i + 2u]);
}

// -ln of the weight of the tap `q` for the pixel `p`; FAR if base colours are no numbers.
fn colored_exponent_at(p: u32, q: u32, offset: vec2i, over_pole: bool) -> f32 {
    let apart = albedo_at(p) - albedo_at(q);
    if !is_finite3(apart) {
        return FAR;
    }
    let far = limited3(apart) * params.albedo;
    let colors = 0.5 * (far_square(far.x) + far_square(far.y) + far_square(far.z));
    return min(exponent_at(p, q, offset, over_pole) + colors, FAR);
}
