// One triangle over the whole picture, at the far end of the depth range; what is above the horizon can be cut off.

uniform mat3 ray_from_pixel;
uniform vec3 picture;  // width and height [px], 1

void main() {
    vec2 corner = vec2(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0);
    gl_Position = vec4(corner, 1.0, 1.0);
    vec2 pixel = 0.5 * (corner + 1.0) * picture.xy - 0.5;
    gl_ClipDistance[0] = -(ray_from_pixel * vec3(pixel, 1.0)).z;
}
