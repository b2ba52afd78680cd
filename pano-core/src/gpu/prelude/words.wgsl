// Tables of many kinds in one buffer; see pano_core::gpu::Words. A shader that includes this says what `word(i)` is.

fn number_at(i: u32) -> f32 {
    return bitcast<f32>(word(i));
}

fn vec3_at(i: u32) -> vec3f {
    return vec3f(number_at(i), number_at(i + 1u), number_at(i + 2u));
}

// A matrix by columns.
fn matrix_at(i: u32) -> mat3x3f {
    return mat3x3f(vec3_at(i), vec3_at(i + 3u), vec3_at(i + 6u));
}

