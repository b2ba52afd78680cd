// Scattering at surfaces, in the order of bsdf/mod.rs, ggx.rs, fresnel.rs and coat.rs, which give the reasons. A shader that
// includes this says what `table_value(i)` is: the i-th number of its coats' tables.

// Any surface reflects other than diffusely; any lets light in.
override GLOSS: bool = true;
override BODIES: bool = true;

// `coat` of a surface without one.
const NO_COAT: u32 = 0xffffffffu;

// A surface point, textures read.
struct Material {
    base_color: vec3f,
    metallic: f32,
    specular_color: vec3f,
    specular: f32,
    alpha: f32,
    ior: f32,
    transmission: f32,
    thin: bool,
    // Where the coat's table begins.
    coat: u32,
}

struct BsdfValue {
    f_cos: vec3f,
    pdf: f32,
}

struct BsdfSample {
    direction: vec3f,
    pdf: f32,
    weight: vec3f,
    specular: bool,
    exists: bool,
}

struct Bsdf {
    tangent: vec3f,
    alpha: f32,
    bitangent: vec3f,
    ior: f32,
    normal: vec3f,
    metal: f32,
    geometric: vec3f,
    coat_shade: f32,
    // Outgoing direction in the frame.
    out: vec3f,
    transmission: f32,
    metal_f0: vec3f,
    coat_table: u32,
    coat: vec3f,
    // 1 of a pane. Not a `bool`, so that surfaces can wait in memory.
    thin: u32,
    diffuse: vec3f,
    tint: vec3f,
    // Probabilities of the diffuse, reflecting and transmitting lobe.
    choose: vec3f,
}

fn ggx_distribution(z: f32, alpha: f32) -> f32 {
    let a2 = alpha * alpha;
    let t = z * z * (a2 - 1.0) + 1.0;
    return a2 / (PI * t * t);
}

fn ggx_lambda(z: f32, alpha: f32) -> f32 {
    let z2 = z * z;
    return 0.5 * (sqrt(1.0 + alpha * alpha * max(1.0 - z2, 0.0) / z2) - 1.0);
}

fn ggx_masking(z: f32, alpha: f32) -> f32 {
    return 1.0 / (1.0 + ggx_lambda(z, alpha));
}

fn ggx_shadowing(o: f32, i: f32, alpha: f32) -> f32 {
    return 1.0 / (1.0 + ggx_lambda(o, alpha) + ggx_lambda(i, alpha));
}

fn ggx_sample_visible_normal(w: vec3f, alpha: f32, u: vec2f) -> vec3f {
    let stretched = normalize(vec3f(w.xy * alpha, w.z));
    let z = (1.0 - u.x) * (1.0 + stretched.z) - stretched.z;
    let turn = sin_cos(TAU * u.y);
    let r = sqrt(clamp(1.0 - z * z, 0.0, 1.0));
    let cap = vec3f(r * turn.y, r * turn.x, z) + stretched;
    return normalize(vec3f(cap.xy * alpha, max(cap.z, 1e-7)));
}

fn fresnel_dielectric(cosine: f32, eta: f32) -> f32 {
    let c = clamp(cosine, 0.0, 1.0);
    let sin2 = (1.0 - c * c) / (eta * eta);
    if sin2 >= 1.0 {
        return 1.0;
    }
    let cos_t = sqrt(1.0 - sin2);
    let parallel = (eta * c - cos_t) / (eta * c + cos_t);
    let perpendicular = (c - eta * cos_t) / (c + eta * cos_t);
    return 0.5 * (parallel * parallel + perpendicular * perpendicular);
}

fn fresnel_schlick(f0: vec3f, share: f32, cosine: f32) -> vec3f {
    let m = clamp(1.0 - cosine, 0.0, 1.0);
    let m2 = m * m;
    return f0 + (vec3f(share) - f0) * (m2 * m2 * m);
}

fn coat_albedo(table: u32, alpha: f32, cosine: f32) -> f32 {
    let a = clamp(alpha, 0.0, 1.0) * f32(COAT_ALPHAS - 1u);
    let c = clamp(cosine, 0.0, 1.0) * f32(COAT_COSINES - 1u);
    let row = min(u32(a), COAT_ALPHAS - 2u);
    let column = min(u32(c), COAT_COSINES - 2u);
    let at = table + row * COAT_COSINES + column;
    let below = at + COAT_COSINES;
    let along = c - f32(column);
    let upper = table_value(at) + (table_value(at + 1u) - table_value(at)) * along;
    let lower = table_value(below) + (table_value(below + 1u) - table_value(below)) * along;
    return upper + (lower - upper) * (a - f32(row));
}

fn coat_mean(table: u32, alpha: f32) -> f32 {
    let a = clamp(alpha, 0.0, 1.0) * f32(COAT_ALPHAS - 1u);
    let row = min(u32(a), COAT_ALPHAS - 2u);
    let at = table + COAT_ALPHAS * COAT_COSINES + row;
    return table_value(at) + (table_value(at + 1u) - table_value(at)) * (a - f32(row));
}

fn bsdf_at(m: Material, geometric: vec3f, shading: vec3f, out: vec3f) -> Bsdf {
    let outside = dot(geometric, out) >= 0.0;
    let opaque_ = m.transmission <= 0.0 || m.metallic >= 1.0 || m.thin;
    let flip = select(-1.0, 1.0, outside || !opaque_);
    let side = select(-1.0, 1.0, outside);
    var bsdf: Bsdf;
    bsdf.geometric = geometric * flip;
    bsdf.normal = shading * flip;
    if dot(bsdf.normal, out) * side * flip <= 1e-4 {
        bsdf.normal = bsdf.geometric;
    }
    bsdf.tangent = tangent_of(bsdf.normal);
    bsdf.bitangent = bitangent_of(bsdf.normal);
    bsdf.out = vec3f(dot(out, bsdf.tangent), dot(out, bsdf.bitangent), dot(out, bsdf.normal));
    let dielectric_share = 1.0 - m.metallic;
    let opaque_share = dielectric_share * (1.0 - m.transmission);
    let has_coat = GLOSS && m.specular > 0.0 && opaque_share > 0.0 && m.coat != NO_COAT && m.ior > 1.0;
    var strength = vec3f(0.0);
    var coated = 0.0;
    var left = 1.0;
    let cosine = min(abs(bsdf.out.z), 1.0);
    bsdf.coat_table = NO_COAT;
    if has_coat {
        strength = m.specular * m.specular_color;
        bsdf.coat_shade = most_of(strength);
        bsdf.coat_table = m.coat;
        coated = bsdf.coat_shade * coat_albedo(m.coat, m.alpha, cosine);
        left = (1.0 - coated) / (1.0 - bsdf.coat_shade * coat_mean(m.coat, m.alpha));
    }
    bsdf.alpha = select(m.alpha, 0.0, m.alpha < SMOOTH_ALPHA);
    bsdf.metal_f0 = m.base_color * m.metallic;
    bsdf.metal = m.metallic;
    bsdf.coat = strength * opaque_share;
    bsdf.ior = m.ior;
    bsdf.diffuse = m.base_color * (opaque_share * left);
    bsdf.transmission = dielectric_share * m.transmission;
    bsdf.tint = m.base_color;
    bsdf.thin = select(0u, 1u, m.thin);
    let reflected = most_of(fresnel_schlick(bsdf.metal_f0, bsdf.metal, cosine)) + coated * opaque_share;
    let scattered = most_of(m.base_color) * opaque_share * (1.0 - coated);
    let sum = reflected + scattered + bsdf.transmission;
    if sum > 0.0 {
        bsdf.choose = vec3f(scattered, reflected, bsdf.transmission) / sum;
    }
    return bsdf;
}

fn bsdf_lambert(albedo: vec3f, normal: vec3f, out: vec3f) -> Bsdf {
    return bsdf_at(Material(albedo, 0.0, vec3f(1.0), 0.0, 1.0, 1.0, 0.0, false, NO_COAT), normal, normal, out);
}

fn bsdf_is_specular(b: Bsdf) -> bool {
    return b.choose.x <= 0.0 && (b.alpha == 0.0 || (b.choose.y <= 0.0 && (b.thin == 1u || b.choose.z <= 0.0)));
}

// Geometric normal on the side to which a ray along `direction` leaves.
fn bsdf_offset_normal(b: Bsdf, direction: vec3f) -> vec3f {
    return select(-b.geometric, b.geometric, dot(b.geometric, direction) >= 0.0);
}

fn bsdf_reflectance(b: Bsdf, cosine: f32) -> vec3f {
    var f = fresnel_schlick(b.metal_f0, b.metal, cosine);
    if b.coat_table != NO_COAT {
        f += b.coat * fresnel_dielectric(cosine, b.ior);
    }
    return f;
}

fn bsdf_way_in(b: Bsdf, cosine: f32) -> f32 {
    if !GLOSS || b.coat_table == NO_COAT {
        return 1.0;
    }
    return 1.0 - b.coat_shade * coat_albedo(b.coat_table, b.alpha, cosine);
}

// The rough body: f·|cos| and the density, its lobe's probability left out.
fn bsdf_eval_body(b: Bsdf, wi: vec3f, same_side: bool) -> BsdfValue {
    let none = BsdfValue(vec3f(0.0), 0.0);
    let wo = b.out;
    let eta = select(1.0 / b.ior, b.ior, wo.z > 0.0);
    let eta_path = select(eta, 1.0, same_side);
    var h = wi * eta_path + wo;
    if dot(h, h) < 1e-12 {
        return none;
    }
    h = normalize(h);
    h = select(h, -h, h.z < 0.0);
    let oh = dot(wo, h);
    let ih = dot(wi, h);
    if oh * wo.z <= 0.0 || ih * wi.z <= 0.0 {
        return none;
    }
    let fresnel = fresnel_dielectric(abs(oh), eta);
    let d = ggx_distribution(h.z, b.alpha);
    let co = abs(wo.z);
    let g = ggx_shadowing(co, abs(wi.z), b.alpha);
    let visible = d * ggx_masking(co, b.alpha) * abs(oh) / co;
    if same_side {
        return BsdfValue(vec3f(b.transmission * d * g * fresnel / (4.0 * co)), visible / (4.0 * abs(oh)) * fresnel);
    }
    let sum = ih + oh / eta_path;
    let denominator = sum * sum;
    let value = d * (1.0 - fresnel) * g * abs(ih * oh / denominator) / (co * eta_path * eta_path);
    return BsdfValue(b.tint * (b.transmission * value), visible * abs(ih) / denominator * (1.0 - fresnel));
}

fn bsdf_eval_local(b: Bsdf, wi: vec3f) -> BsdfValue {
    var value = BsdfValue(vec3f(0.0), 0.0);
    let same_side = (wi.z > 0.0) == (b.out.z > 0.0);
    if same_side && b.choose.x > 0.0 {
        let cosine = abs(wi.z);
        value.f_cos += b.diffuse * (bsdf_way_in(b, cosine) * cosine / PI);
        value.pdf += b.choose.x * cosine / PI;
    }
    if b.alpha == 0.0 {
        return value;
    }
    if GLOSS && same_side && b.choose.y > 0.0 {
        let o = vec3f(b.out.xy, abs(b.out.z));
        let i = vec3f(wi.xy, abs(wi.z));
        let h = normalize(o + i);
        let both = ggx_distribution(h.z, b.alpha) / (4.0 * o.z);
        value.f_cos += bsdf_reflectance(b, dot(o, h)) * (both * ggx_shadowing(o.z, i.z, b.alpha));
        value.pdf += b.choose.y * both * ggx_masking(o.z, b.alpha);
    }
    if BODIES && b.choose.z > 0.0 && b.thin == 0u {
        let body = bsdf_eval_body(b, wi, same_side);
        value.f_cos += body.f_cos;
        value.pdf += b.choose.z * body.pdf;
    }
    return value;
}

fn bsdf_eval(b: Bsdf, direction: vec3f) -> BsdfValue {
    let wi = vec3f(dot(direction, b.tangent), dot(direction, b.bitangent), dot(direction, b.normal));
    if wi.z == 0.0 || b.out.z == 0.0 || (wi.z > 0.0) != (dot(direction, b.geometric) > 0.0) {
        return BsdfValue(vec3f(0.0), 0.0);
    }
    return bsdf_eval_local(b, wi);
}

// A direction in the frame, before it is known whether the surface's sides agree on it.
struct LocalSample {
    wi: vec3f,
    exists: bool,
    // Of a perfectly smooth choice.
    weight: vec3f,
    specular: bool,
}

fn bsdf_sample_body(b: Bsdf, at: vec2f, u: f32) -> LocalSample {
    let share = b.transmission / b.choose.z;
    let wo = b.out;
    var s: LocalSample;
    if b.thin == 1u {
        let once = fresnel_dielectric(abs(wo.z), b.ior);
        let r = 2.0 * once / (1.0 + once);
        if u < r {
            return LocalSample(vec3f(-wo.xy, wo.z), true, vec3f(share), true);
        }
        return LocalSample(-wo, true, b.tint * share, true);
    }
    let eta = select(1.0 / b.ior, b.ior, wo.z > 0.0);
    let up = vec3f(wo.xy, abs(wo.z));
    var h = vec3f(0.0, 0.0, 1.0);
    if b.alpha != 0.0 {
        h = ggx_sample_visible_normal(up, b.alpha, at);
    }
    let cosine = dot(up, h);
    let reflecting = u < fresnel_dielectric(cosine, eta);
    var wi = h * (2.0 * cosine) - up;
    if !reflecting {
        let sin2 = max(1.0 - cosine * cosine, 0.0) / (eta * eta);
        if sin2 >= 1.0 {
            return s;
        }
        wi = h * (cosine / eta - sqrt(1.0 - sin2)) - up / eta;
    }
    if (wi.z > 0.0) != reflecting || wi.z == 0.0 {
        return s;
    }
    s.exists = true;
    s.wi = vec3f(wi.xy, wi.z * copy_sign(1.0, wo.z));
    s.specular = b.alpha == 0.0;
    s.weight = select(b.tint * (share / (eta * eta)), vec3f(share), reflecting);
    return s;
}

fn bsdf_sample(b: Bsdf, u: vec4f) -> BsdfSample {
    var sample: BsdfSample;
    var local: LocalSample;
    if u.z < b.choose.x {
        let disc = concentric_disc(u.xy);
        let z = sqrt(max(1.0 - dot(disc, disc), 0.0));
        local = LocalSample(vec3f(disc, copy_sign(z, b.out.z)), true, vec3f(0.0), false);
    } else if GLOSS && u.z < b.choose.x + b.choose.y {
        let up = vec3f(b.out.xy, abs(b.out.z));
        var h = vec3f(0.0, 0.0, 1.0);
        if b.alpha != 0.0 {
            h = ggx_sample_visible_normal(up, b.alpha, u.xy);
        }
        let wi = h * (2.0 * dot(up, h)) - up;
        local.exists = wi.z > 0.0;
        local.wi = vec3f(wi.xy, copy_sign(wi.z, b.out.z));
        local.specular = b.alpha == 0.0;
        local.weight = bsdf_reflectance(b, up.z) / b.choose.y;
    } else if BODIES && b.choose.z > 0.0 {
        local = bsdf_sample_body(b, u.xy, u.w);
    }
    if !local.exists {
        return sample;
    }
    let wi = local.wi;
    sample.direction = normalize(b.tangent * wi.x + b.bitangent * wi.y + b.normal * wi.z);
    if (wi.z > 0.0) != (dot(sample.direction, b.geometric) > 0.0) {
        return sample;
    }
    sample.specular = local.specular;
    if local.specular {
        sample.exists = true;
        sample.weight = local.weight;
        return sample;
    }
    let value = bsdf_eval_local(b, wi);
    if value.pdf > 0.0 {
        sample.exists = true;
        sample.pdf = value.pdf;
        sample.weight = value.f_cos / value.pdf;
    }
    return sample;
}

// What a surface makes of light that is the same all around its lobes; see Bsdf::lobes.
struct Lobes {
    diffuse: vec3f,
    roughness: f32,
    specular: vec3f,
    transmission: f32,
}

// Scale and bias of a conductor's reflectance at normal incidence that make it its directional albedo.
fn split_sum(roughness: f32, cosine: f32) -> vec2f {
    let r = vec4f(1.0 - roughness, 0.0425 - 0.0275 * roughness, 1.04 - 0.572 * roughness, 0.022 * roughness - 0.04);
    let a = min(r.x * r.x, exp2(-9.28 * cosine)) * r.x + r.y;
    return vec2f(-1.04, 1.04) * a + r.zw;
}

fn bsdf_lobes(b: Bsdf) -> Lobes {
    var lobes = Lobes(b.diffuse, sqrt(b.alpha), vec3f(0.0), b.transmission);
    if !GLOSS {
        return lobes;
    }
    let cosine = min(abs(b.out.z), 1.0);
    let coated = b.coat_table != NO_COAT;
    if coated {
        lobes.diffuse *= 1.0 - b.coat_shade * coat_mean(b.coat_table, b.alpha);
    }
    if b.alpha == 0.0 {
        lobes.specular = bsdf_reflectance(b, cosine);
        return lobes;
    }
    let split = split_sum(lobes.roughness, cosine);
    lobes.specular = b.metal_f0 * split.x + b.metal * split.y;
    if coated {
        lobes.specular += b.coat * coat_albedo(b.coat_table, b.alpha, cosine);
    }
    return lobes;
}

// Reflectance of a real surface with full gloss; see fresnel.rs.
fn gloss_fresnel(cosine: f32) -> f32 {
    let m = 1.0 - clamp(cosine, 0.0, 1.0);
    return GLOSS_F0 + (1.0 - GLOSS_F0) * (m * m * m * m * m);
}
