// Which triangle is seen.

flat in int triangle_id;

layout(location = 0) out int seen;

void main() {
    seen = triangle_id;
}
