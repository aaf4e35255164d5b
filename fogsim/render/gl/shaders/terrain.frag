// Level grassland to the horizon, by the exact ray of the pixel.

uniform mat3 ray_from_pixel;
uniform vec3 eye;
uniform float illuminance;
uniform float focal_length;
uniform float terrain_height;  // of the camera above it [m]
uniform vec3 terrain_reflectance;

layout(location = 0) out vec4 radiance_and_distance;
layout(location = 1) out int instance;

const float PI = 3.14159265358979;

vec3 grass(vec2 place, vec2 footprint) {
    float tufts = 0.24 * grain(place, 0.08, footprint, 21u) + 0.13 * grain(place, 0.7, footprint, 22u);
    float meadow = 0.13 * grain(place, 5.0, footprint, 23u);
    float dry = 0.5 + 0.5 * grain(place, 31.0, footprint, 25u);
    vec3 tint = mix(vec3(1.0), vec3(1.25, 1.02, 0.95), dry * 0.6);
    return terrain_reflectance * tint * (1.0 + tufts + meadow);
}

void main() {
    vec3 ray = ray_from_pixel * vec3(gl_FragCoord.xy - 0.5, 1.0);
    float stretch = length(ray);
    float sine = ray.z / stretch;
    if (sine >= 0.0) discard;  // where the camera rolls, the horizon crosses rows
    float distance = terrain_height / -sine;
    vec2 place = eye.xy + ray.xy * (distance / stretch);
    float across = distance / (stretch * focal_length);
    vec3 reflectance = grass(place, vec2(across, across / -sine));
    radiance_and_distance = vec4(reflectance * (illuminance / PI), distance);
    instance = 1;
}
