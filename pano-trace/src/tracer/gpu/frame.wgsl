// A frame of the path tracers: what is bound, pixels before their first sample. One invocation a pixel.

struct Trace {
    rows: Rows,
    view: View,
    world: World,
    bounces: u32,
    // Samples that a pixel takes.
    samples: u32,
    // Samples of this submission.
    begin: u32,
    end: u32,
    clusters: vec2u,
    // Points of the light: position and squared distance from the viewer, or direction and 0.
    lights: vec2u,
}

// A pixel under way.
struct Started {
    pixel: Pixel,
    // Samples it takes; after `start` one in how many its centre asks for.
    most: u32,
    // How many of the frame's samples each stands for.
    boost: f32,
    // Whether an object may be seen.
    mixed: u32,
    // How often each sample looks for changes.
    share: f32,
}

@group(0) @binding(0) var<uniform> params: Trace;
@group(0) @binding(6) var<storage, read_write> pixels: array<Started>;

// Which estimator, and which strategies for direct light: in the order of TraceParams.
override METHOD: u32 = 0u;
const DPT: u32 = 0u;
const ONE_PASS: u32 = 1u;
const TWO_PASS: u32 = 2u;
const IBL: u32 = 3u;
override MIS: u32 = 0u;
const BALANCE: u32 = 0u;
const LIGHT_ONLY: u32 = 1u;
const BSDF_ONLY: u32 = 2u;
// Some objects shine; every pixel and direction is asked for a change; changed surfaces change one another.
override EMITTERS: bool = true;
override EVERYWHERE: bool = false;
override SECOND_ORDER: bool = true;

// Guides of each pixel, and what its centre asks for.
@compute @workgroup_size(8, 8)
fn start(@builtin(global_invocation_id) id: vec3u) {
    if !is_held(params.rows, id) {
        return;
    }
    let texel = texel_of(params.rows, id);
    let corner = vec2f(texel);
    let guides = guides_at(corner + 0.5);
    var started: Started;
    started.pixel = guides.pixel;
    started.mixed = select(0u, 1u, may_see_objects(corner));
    started.most = MOST_THINNING;
    if guides.real.exists {
        started.most = thinning_of(guides.real);
    }
    if METHOD == IBL {
        started.most = NO_SAMPLES;
    }
    if started.mixed == 1u || METHOD == ONE_PASS || METHOD == TWO_PASS || EVERYWHERE {
        started.most = 1u;
    }
    pixels[index_of(params.rows, texel)] = started;
}
