// Radiance and distance of what is not road.
// It has a shader of its own since software renderers run through both sides of every branch.

in vec3 offset;
in vec3 radiance;
flat in ivec2 kind;

layout(location = 0) out vec4 radiance_and_distance;
layout(location = 1) out int instance;

void main() {
    radiance_and_distance = vec4(radiance, length(offset));
    instance = kind.y;
}
