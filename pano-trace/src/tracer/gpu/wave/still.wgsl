// The panorama shows real surfaces as they were captured: what objects change of them is found on the way.
const UPDATES: bool = false;

fn update_at(uv: vec2f) -> Update {
    return Update(vec3f(0.0), 1.0, 0.0);
}
