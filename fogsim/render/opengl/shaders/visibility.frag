// Which triangle is seen.

flat in int slot;

layout(location = 0) out int seen;

void main() {
    seen = slot;
}
