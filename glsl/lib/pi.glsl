// The one constant that every formula shares.

const float PI = 3.14159265358979;
