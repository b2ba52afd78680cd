// Interactive panoramic ray tracing: the settings of a stage.

struct Iprt {
    // Of the view, or of the panorama that is updated.
    rows: Rows,
    view: View,
    world: World,
    field: Field,
    bounces: u32,
    samples: u32,
    // Which of the counters this turn adds to.
    turn: u32,
    // Points of a pixel that a sample tries.
    attempts: u32,
    clusters: vec2u,
    lights: vec2u,
    // Texels of what is known of the panorama's change.
    update_size: vec2u,
    view_size: vec2u,
    // The view of the frame before, if there is one.
    earlier: View,
    has_earlier: u32,
    // The view is the panorama's own.
    at_capture: u32,
    // Where in the tables are the objects' moves since then.
    moves: u32,
    // 1 for the pixels of objects.
    virtual_pass: u32,
}

@group(0) @binding(0) var<uniform> params: Iprt;
