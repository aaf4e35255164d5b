// A vertex of a copy of a shape; everything is relative to the camera, so that far from the origin nothing jitters.

layout(location = 0) in vec3 position;
layout(location = 1) in vec3 normal;
layout(location = 2) in vec3 reflectance;
layout(location = 3) in vec4 road;
layout(location = 4) in ivec2 surface_and_instance;
layout(location = 5) in vec4 copy_x;  // rows of the copy's transform, to offsets from the camera in world axes
layout(location = 6) in vec4 copy_y;
layout(location = 7) in vec4 copy_z;
layout(location = 8) in vec3 copy_paint;
layout(location = 9) in ivec2 copy_lamps_and_instance;

uniform mat4 clip_from_offset;
uniform ivec4 lamp_masks[3];
uniform vec3 lamp_radiance[12];

uniform float illuminance;

out vec3 offset;
out vec3 radiance;
out vec4 lane;
flat out float white;  // radiance of a white surface there [cd/m²]
flat out ivec2 kind;

const int PAINT = 1;
const float PI = 3.14159265358979;

// What reaches a surface of the light of an overcast sky and, from below, of the ground's; a little more comes from
// one side so that shapes read. A level surface gets exactly 1.
float light(vec3 normal) {
    return 0.5 + 0.5 * normal.z + 0.06 * (1.0 - normal.z) + 0.07 * dot(normal.xy, vec2(0.5, -0.86));
}

void main() {
    vec4 local = vec4(position, 1.0);
    offset = vec3(dot(copy_x, local), dot(copy_y, local), dot(copy_z, local));
    gl_Position = clip_from_offset * vec4(offset, 1.0);

    vec3 x = vec3(copy_x.x, copy_y.x, copy_z.x), y = vec3(copy_x.y, copy_y.y, copy_z.y);
    vec3 z = vec3(copy_x.z, copy_y.z, copy_z.z);
    vec3 facing = normalize(x * (normal.x / dot(x, x)) + y * (normal.y / dot(y, y)) + z * (normal.z / dot(z, z)));

    int surface = surface_and_instance.x;
    white = light(facing) * illuminance / PI;
    radiance = (surface == PAINT ? copy_paint : reflectance) * white;
    bool lit = (copy_lamps_and_instance.x & lamp_masks[surface >> 2][surface & 3]) != 0;
    if (lit) radiance += lamp_radiance[surface];
    lane = road;
    int instance = copy_lamps_and_instance.y;
    kind = ivec2(surface, instance != 0 ? instance : surface_and_instance.y);
}
