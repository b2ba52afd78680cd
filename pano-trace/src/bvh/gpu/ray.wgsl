// A ray of a list, as the host uploads it.

struct Ray {
    origin: vec3f,
    // The largest number for none.
    t_max: f32,
    direction: vec3f,
    pad: u32,
}
