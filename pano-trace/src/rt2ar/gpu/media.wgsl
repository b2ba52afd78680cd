// The bodies that a ray is in, and what their surfaces do to it; see media.rs.

struct Media {
    count: u32,
    // Of each the instance, and where its material begins in the tables; the one entered last comes last.
    instances: array<u32, MAX_NESTED>,
    materials: array<u32, MAX_NESTED>,
}

// Those of the ray in hand.
var<private> media: Media;

fn media_ior() -> f32 {
    if !BODIES || media.count == 0u {
        return 1.0;
    }
    return number_at(media.materials[media.count - 1u] + IOR_WORD);
}

// What is left of light after `t` metres here.
fn media_transmittance(t: f32) -> vec3f {
    if !BODIES || media.count == 0u {
        return vec3f(1.0);
    }
    let material = media.materials[media.count - 1u];
    let distance = number_at(material + ABSORPTION_WORD + 3u);
    if distance <= 0.0 {
        return vec3f(1.0);
    }
    let color = vec3_at(material + ABSORPTION_WORD);
    // Exactly nothing is taken of a channel that passes, however far.
    return select(transmittance_of(color, distance, t), vec3f(1.0), color >= vec3f(1.0));
}

// The ray in hand goes through the surface of a body; the index there over the index here.
fn cross_body(instance: u32, material: u32, outside: bool) -> f32 {
    var here = media_ior();
    if outside {
        if media.count == MAX_NESTED {
            return 1.0;
        }
        media.instances[media.count] = instance;
        media.materials[media.count] = material;
        media.count += 1u;
    } else {
        var place = media.count;
        for (var i = 0u; i < media.count; i++) {
            if media.instances[i] == instance {
                place = i;
            }
        }
        if place == media.count {
            // The ray began in it.
            here = number_at(material + IOR_WORD);
        } else {
            for (var i = place + 1u; i < media.count; i++) {
                media.instances[i - 1u] = media.instances[i];
                media.materials[i - 1u] = media.materials[i];
            }
            media.count -= 1u;
        }
    }
    let there = media_ior();
    return select(there / here, 1.0, there == here);
}

// Share of a surface that is clear; 0 of what lets nothing in.
fn clear_share(m: Material) -> f32 {
    return m.transmission * (1.0 - m.metallic);
}

// Share of the light that a clear surface reflects.
fn clear_reflectance(m: Material, cosine: f32, eta: f32) -> f32 {
    if m.thin {
        let face = fresnel_dielectric(cosine, m.ior);
        return 2.0 * face / (1.0 + face);
    }
    return select(fresnel_dielectric(cosine, eta), 0.0, eta == 1.0);
}

struct Bent {
    direction: vec3f,
    exists: bool,
}

fn refracted(direction: vec3f, normal: vec3f, eta: f32) -> Bent {
    if eta == 1.0 {
        return Bent(direction, true);
    }
    let cosine = -dot(direction, normal);
    let sin2 = max(1.0 - cosine * cosine, 0.0) / (eta * eta);
    let along = direction / eta + normal * (cosine / eta - sqrt(max(1.0 - sin2, 0.0)));
    return Bent(normalize(along), sin2 < 1.0);
}

// A microfacet of a rough surface, as seen from unit `out`.
fn facet_of(normal: vec3f, out: vec3f, alpha: f32, u: vec2f) -> vec3f {
    let a = tangent_of(normal);
    let b = bitangent_of(normal);
    let half_ = ggx_sample_visible_normal(vec3f(dot(out, a), dot(out, b), max(dot(out, normal), 0.0)), alpha, u);
    return a * half_.x + b * half_.y + normal * half_.z;
}

// Share of the light along `direction` that other facets do not block, of what is seen from `out`.
fn facets_let_through(normal: vec3f, out: vec3f, direction: vec3f, alpha: f32) -> f32 {
    let o = max(abs(dot(out, normal)), 1e-6);
    let i = max(abs(dot(direction, normal)), 1e-6);
    return ggx_shadowing(o, i, alpha) / ggx_masking(o, alpha);
}

// The surface at a hit cannot be seen: clear, with the index of its surroundings, and nothing taken away.
fn is_unseen(s: Surface, material: u32, eta: f32) -> bool {
    let m = s.material;
    let takes_nothing = all(m.base_color * clear_share(m) == vec3f(1.0)) && all(s.emission == vec3f(0.0));
    let absorbs = number_at(material + ABSORPTION_WORD + 3u) > 0.0 && any(vec3_at(material + ABSORPTION_WORD) != vec3f(1.0));
    return takes_nothing && !absorbs && eta == 1.0;
}
