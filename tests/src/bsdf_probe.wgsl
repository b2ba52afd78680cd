// Asks a surface what it makes of a direction, and for a direction: one invocation a question.

struct Question {
    base_color: vec3f,
    metallic: f32,
    specular_color: vec3f,
    specular: f32,
    alpha: f32,
    ior: f32,
    transmission: f32,
    // 1 a sheet, 2 coated.
    flags: u32,
    geometric: vec3f,
    pad1: u32,
    normal: vec3f,
    pad2: u32,
    out: vec3f,
    pad3: u32,
    direction: vec3f,
    pad4: u32,
    u: vec4f,
}

struct Reply {
    f_cos: vec3f,
    pdf: f32,
    direction: vec3f,
    sample_pdf: f32,
    weight: vec3f,
    // 1 there is a sample, 2 it is of a smooth lobe, 4 every lobe is smooth.
    flags: u32,
    lobes: Lobes,
}

@group(0) @binding(0) var<uniform> count: vec4u;
@group(0) @binding(1) var<storage, read> questions: array<Question>;
@group(0) @binding(2) var<storage, read_write> replies: array<Reply>;
@group(0) @binding(3) var<storage, read> table: array<f32>;

fn table_value(i: u32) -> f32 {
    return table[i];
}

@compute @workgroup_size(64)
fn scatter(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= count.x {
        return;
    }
    let q = questions[id.x];
    let coat = select(NO_COAT, 0u, (q.flags & 2u) != 0u);
    let thin = (q.flags & 1u) != 0u;
    let m = Material(q.base_color, q.metallic, q.specular_color, q.specular, q.alpha, q.ior, q.transmission, thin, coat);
    let bsdf = bsdf_at(m, q.geometric, q.normal, q.out);
    let value = bsdf_eval(bsdf, q.direction);
    let sample = bsdf_sample(bsdf, q.u);
    let flags = select(0u, 1u, sample.exists) | select(0u, 2u, sample.specular) | select(0u, 4u, bsdf_is_specular(bsdf));
    replies[id.x] = Reply(value.f_cos, value.pdf, sample.direction, sample.pdf, sample.weight, flags, bsdf_lobes(bsdf));
}
