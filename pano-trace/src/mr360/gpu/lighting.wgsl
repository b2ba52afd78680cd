// Pixels of MR360 and its lamps, beside what lights them (maps.wgsl).

// A pixel under way.
struct LitPixel {
    pixel: Pixel,
    // What the view shows without objects.
    photo: vec3f,
    // Whether an object may be seen.
    mixed: u32,
}

@group(0) @binding(6) var<storage, read_write> pixels: array<LitPixel>;
// Per pixel and lamp: samples that it reaches.
@group(0) @binding(9) var<storage, read_write> reached: array<u32>;

// Lamps cast shadows; objects darken what they are near to; real surfaces mirror objects.
override SHADOWS: bool = true;
override AMBIENT_OCCLUSION: bool = true;
override MIRRORING: bool = true;

struct Source {
    // Of its middle.
    direction: vec3f,
    cos_radius: f32,
    intensity: vec3f,
}

fn source_at(i: u32) -> Source {
    let at = params.lighting.lamps + SOURCE_WORDS * i;
    return Source(vec3_at(at), number_at(at + 3u), vec3_at(at + 4u));
}
