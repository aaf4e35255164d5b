// CIE standard overcast sky.

uniform mat3 ray_from_pixel;
uniform vec3 zenith;

layout(location = 0) out vec4 radiance_and_distance;
layout(location = 1) out int instance;

void main() {
    float sine = normalize(ray_from_pixel * vec3(gl_FragCoord.xy - 0.5, 1.0)).z;
    float infinity = uintBitsToFloat(0x7F800000u);
    radiance_and_distance = vec4(zenith * ((1.0 + 2.0 * max(sine, 0.0)) / 3.0), infinity);
    instance = 0;
}
