// Colour; see pano_core::color.

fn luminance(rgb: vec3f) -> f32 {
    return dot(rgb, LUMINANCE_WEIGHTS);
}

