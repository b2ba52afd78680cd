// Counter-based random numbers, bit for bit those of pano_core::random.

fn hash(value: u32) -> u32 {
    var x = value;
    x ^= x >> 16u;
    x *= 0x7feb352du;
    x ^= x >> 15u;
    x *= 0x846ca68bu;
    return x ^ (x >> 16u);
}

fn combine(state: u32, value: u32) -> u32 {
    return hash(state ^ (value * 0x9e3779b9u + 0x85ebca6bu));
}

// The random numbers of one sample of one pixel.
struct Sampler {
    index: u32,
    scramble: u32,
    group: u32,
}

fn sampler_of(pixel: vec2u, index: u32, frame: u32, seed: u32) -> Sampler {
    let scramble = combine(combine(combine(combine(0x5eedu, pixel.x), pixel.y), frame), seed);
    return Sampler(index % SEQUENCE_LENGTH, combine(scramble, index / SEQUENCE_LENGTH), 0u);
}

// Hash of Burley's sampler (the crate sobol_burley, parts::hash).
fn burley_hash(value: u32) -> u32 {
    var n = value ^ 0xe6fe3bebu;
    n ^= n >> 16u;
    n *= 0x7feb352du;
    n ^= n >> 15u;
    n *= 0x846ca68bu;
    n ^= n >> 16u;
    return n;
}

// Owen scrambling of reversed bits, by the hash of N. Vegdahl.
fn owen_scramble(reversed: u32, scramble: u32) -> u32 {
    var n = reversed;
    n ^= n * 0x3d20adeau;
    n += scramble;
    n *= (scramble >> 16u) | 1u;
    n ^= n * 0x05526c56u;
    n ^= n * 0x53a22864u;
    return n;
}

// The next four numbers in [0, 1).
fn next_4d(state: ptr<function, Sampler>) -> vec4f {
    let seed = combine((*state).scramble, (*state).group);
    (*state).group += 1u;
    let shuffled = owen_scramble(reverseBits((*state).index), burley_hash(seed ^ 0x79c68e4au));
    var sobol = vec4u(0u);
    var vectors = SOBOL_VECTORS;
    for (var bit = 0u; bit < 16u; bit++) {
        if ((shuffled >> (31u - bit)) & 1u) != 0u {
            sobol ^= vec4u(vectors[4u * bit], vectors[4u * bit + 1u], vectors[4u * bit + 2u], vectors[4u * bit + 3u]);
        }
    }
    let scrambles = vec4u(seed * 0x9c8f2d3bu) ^ vec4u(0x912f69bau, 0x174f18abu, 0x691e72cau, 0xb40cc1b8u);
    var numbers: vec4f;
    for (var d = 0u; d < 4u; d++) {
        let bits = reverseBits(owen_scramble(sobol[d], burley_hash(scrambles[d])));
        // 23 bits of mantissa: the number is exact, and below 1.
        numbers[d] = bitcast<f32>((bits >> 9u) | 0x3f800000u) - 1.0;
    }
    return numbers;
}

