// Asphalt with grain and painted lines.

in vec3 offset;
in vec3 radiance;
in vec4 lane;
flat in float white;
flat in ivec2 kind;

uniform vec3 eye;

layout(location = 0) out vec4 radiance_and_distance;
layout(location = 1) out int instance;

const float LINE_REFLECTANCE = 0.6, LINE_WIDTH = 0.2, DASH = 6.0, PERIOD = 18.0;

// Length of what lies below x of lines that start at multiples of the period.
float painted_below(float x) {
    return floor(x / PERIOD) * DASH + min(mod(x, PERIOD), DASH);
}

// Share of the footprint across the lane that a line around `middle` covers, times its share along the lane.
float line_share(float code, float middle, vec2 place, vec2 footprint) {
    if (code < 0.5) return 0.0;
    float low = max(place.y - 0.5 * footprint.y, middle - 0.5 * LINE_WIDTH);
    float high = min(place.y + 0.5 * footprint.y, middle + 0.5 * LINE_WIDTH);
    float across = max(high - low, 0.0) / footprint.y;
    if (code < 1.5 || across == 0.0) return across;
    float start = place.x - 0.5 * footprint.x;
    return across * (painted_below(start + footprint.x) - painted_below(start)) / footprint.x;
}

float wheel_track(float left, float width) {
    float near_track = (abs(left) - 0.85) / (0.28 + 0.5 * width);
    return 0.28 / (0.28 + 0.5 * width) * exp(-near_track * near_track);
}

vec3 road_radiance(vec2 ground, vec2 footprint) {
    vec2 spread = max(fwidth(lane.xy), vec2(1e-4));
    float patches = 0.6 * grain(ground, 12.0, footprint, 11u) + 0.4 * grain(ground, 3.0, footprint, 12u);
    float stones = 0.05 * grain(ground, 0.25, footprint, 13u) + 0.16 * grain(ground, 0.03, footprint, 14u);
    vec3 asphalt = radiance * (1.0 + 0.03 * patches + stones - 0.035 * wheel_track(lane.y, spread.y));
    float left = floor(lane.w / 3.0 + 0.1);
    float right = lane.w - 3.0 * left;
    float share = line_share(left, lane.z, lane.xy, spread) + line_share(right, -lane.z, lane.xy, spread);
    if (share == 0.0) return asphalt;
    vec3 paint = vec3(white * LINE_REFLECTANCE * (1.0 + 0.08 * grain(ground, 0.05, footprint, 15u)));
    return mix(asphalt, paint, min(share, 1.0));
}

void main() {
    vec2 across = dFdx(offset.xy), along = dFdy(offset.xy);
    vec3 seen = road_radiance(eye.xy + offset.xy, vec2(length(across), length(along)));
    radiance_and_distance = vec4(seen, length(offset));
    instance = kind.y;
}
