// A corner of a triangle of a copy. Depth is infinite at the far end and NEAR in front of the camera at the near one.

layout(location = 0) in vec3 position;
layout(location = 1) in int triangle;
layout(location = 2) in vec4 clip_x;  // rows of the copy's transform to clip coordinates
layout(location = 3) in vec4 clip_y;
layout(location = 4) in vec4 clip_w;
layout(location = 5) in int first;

flat out int triangle_id;

void main() {
    vec4 local = vec4(position, 1.0);
    float w = dot(clip_w, local);
    gl_Position = vec4(dot(clip_x, local), dot(clip_y, local), w - 2.0 * NEAR, w);
    triangle_id = first + triangle;
}
