// What lights a frame: convolved maps, and where the lamps are. A shader that includes this has `lighting: Lighting` in its uniform
// `params`.

struct Lighting {
    // Columns of the turn from the world into the maps' frame.
    map_x: vec3f,
    // The table of the maps: for each where it begins among the pictures, its size, the roughness it is for. First the diffuse one, then
    // the others from smooth to rough.
    maps: u32,
    map_y: vec3f,
    lamps: u32,
    map_z: vec3f,
    lamp_count: u32,
    // Where the panorama was captured.
    capture: vec3f,
    // How much real surfaces mirror objects, and how roughly.
    gloss: f32,
    gloss_roughness: f32,
    pad0: u32,
    pad1: u32,
    pad2: u32,
}

fn map_uv(d: vec3f) -> vec2f {
    return uv_from_direction(params.lighting.map_x * d.x + params.lighting.map_y * d.y + params.lighting.map_z * d.z);
}

fn map_look(map: u32, uv: vec2f) -> vec3f {
    let at = params.lighting.maps + MAP_WORDS * map;
    return picture_at(word(at), vec2u(word(at + 1u), word(at + 2u)), uv);
}

fn map_roughness(map: u32) -> f32 {
    return number_at(params.lighting.maps + MAP_WORDS * map + 3u);
}

// Radiance that a white diffuse surface sends back.
fn diffuse_look(normal: vec3f) -> vec3f {
    return map_look(0u, map_uv(normal));
}

// Mean radiance in the lobe about `d`; see RadianceMaps::specular.
fn specular_look(d: vec3f, roughness: f32) -> vec3f {
    var above = 2u;
    while above + 1u < MAPS && roughness > map_roughness(above) {
        above += 1u;
    }
    let lower = map_roughness(above - 1u);
    let share = clamp((roughness - lower) / (map_roughness(above) - lower), 0.0, 1.0);
    let uv = map_uv(d);
    var sum = vec3f(0.0);
    for (var i = 0u; i < 2u; i++) {
        let weight = select(1.0 - share, share, i == 1u);
        if weight > 0.0 {
            sum += map_look(above - 1u + i, uv) * weight;
        }
    }
    return sum;
}
