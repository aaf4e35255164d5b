// Random texture that is a function of place alone and is averaged over the footprint of a pixel.

float hash(ivec2 cell, uint seed) {
    uint x = uint(cell.x) * 0x9E3779B1u ^ uint(cell.y) * 0x85EBCA77u ^ seed;
    x ^= x >> 15; x *= 0x2C1B3C6Du; x ^= x >> 12; x *= 0x297A2D39u; x ^= x >> 15;
    return float(x >> 8) * (2.0 / 16777216.0) - 1.0;
}

// Value noise, −1 … 1, with one random value for each square of side 1.
float value_noise(vec2 place, uint seed) {
    vec2 corner = floor(place);
    vec2 share = place - corner;
    share = share * share * (3.0 - 2.0 * share);
    ivec2 cell = ivec2(corner);
    float lower = mix(hash(cell, seed), hash(cell + ivec2(1, 0), seed), share.x);
    float upper = mix(hash(cell + ivec2(0, 1), seed), hash(cell + ivec2(1, 1), seed), share.x);
    return mix(lower, upper, share.y);
}

// Noise with squares of a side [m]. A footprint [m] that covers many squares averages independent values, so that
// the deviation falls with the square root of their number.
float grain(vec2 place, float side, vec2 footprint, uint seed) {
    vec2 covered = max(footprint / side, vec2(1.0));
    float fade = inversesqrt(covered.x * covered.y);
    return fade < 0.03 ? 0.0 : fade * value_noise(place / side, seed);
}
