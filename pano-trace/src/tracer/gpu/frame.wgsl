// A frame of the path tracers: its settings, and pixels before their first sample. The uniform has, beside view and world, `rows`,
// `bounces`, `samples`, `clusters` and, as `lights`, points of the light: position and squared distance from the viewer, or direction
// and 0.

// A pixel under way.
struct Started {
    pixel: Pixel,
    // Samples it takes; after `start` one in how many its centre asks for.
    most: u32,
    // How many of the frame's samples each stands for.
    boost: f32,
    // Whether an object may be seen.
    mixed: u32,
    // How many of these look for changes, as a share; the others count as none.
    share: f32,
    // How noisy it is, see adaptive::Noise: the sum of the batch in hand, mean of the others, squared differences from that.
    sum: f32,
    mean: f32,
    squares: f32,
    // Samples so far.
    taken: u32,
}

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
// Noise is measured.
override ADAPTIVE: bool = true;
// The change of points is asked for.
override POINTS: bool = true;

// The pixel with those guides, and what its centre asks for.
fn begin_pixel(texel: vec2i, guides: Guides) {
    var started: Started;
    started.pixel = guides.pixel;
    started.mixed = select(0u, 1u, may_see_objects(vec2f(texel)));
    if EVERYWHERE || METHOD != DPT || params.samples == 1u {
        started.most = select(1u, NO_SAMPLES, !EVERYWHERE && METHOD == IBL && started.mixed == 0u);
    } else if guides.real.exists {
        started.most = thinning_of(guides.real, guides.matter, camera_direction(vec2f(texel) + 0.5));
    } else {
        // An object, or infinity.
        started.most = select(1u, MOST_THINNING, guides.pixel.depth < 0.0);
    }
    pixels[index_of(params.rows, texel)] = started;
}
