// Median of nine values per channel. Its test compares with numpy's median, exactly.

void order(inout vec4 a, inout vec4 b) {
    vec4 low = min(a, b);
    b = max(a, b);
    a = low;
}

// Nineteen exchanges that leave the fifth largest in the middle (Smith 1996, "Implementing median filters in XC4000E
// FPGAs", Xcell 23).
vec4 median9(vec4 v[9]) {
    order(v[1], v[2]); order(v[4], v[5]); order(v[7], v[8]);
    order(v[0], v[1]); order(v[3], v[4]); order(v[6], v[7]);
    order(v[1], v[2]); order(v[4], v[5]); order(v[7], v[8]);
    order(v[0], v[3]); order(v[5], v[8]); order(v[4], v[7]);
    order(v[3], v[6]); order(v[1], v[4]); order(v[2], v[5]);
    order(v[4], v[7]); order(v[4], v[2]); order(v[6], v[4]);
    order(v[4], v[2]);
    return v[4];
}
