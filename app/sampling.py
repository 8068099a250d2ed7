"""Low-discrepancy points: Owen-scrambled Sobol in four dimensions. Bit-exact twin of glsl/lib/sampling.glsl.

Dimensions 0 and 1 place a sample on the lens, 2 and 3 within the pixel. Direction numbers: Joe and Kuo 2008, first four
dimensions. The scramble is a hash that only lets higher bits depend on lower ones after bit reversal (Laine and Karras
2011), so every power-of-two prefix stays stratified.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

U32 = NDArray[np.uint32]

_BITS = 32
# (degree, coefficients, first m values) of the primitive polynomials of dimensions 1 to 3; dimension 0: van der Corput
_POLYNOMIALS = ((1, 0, (1,)), (2, 1, (1, 3)), (3, 1, (1, 3, 1)))


def sobol_directions() -> U32:
    """Direction numbers (32 bits, 4 dimensions): the table printed into glsl/lib/sampling.glsl."""
    table = np.zeros((_BITS, 4), np.uint64)
    table[:, 0] = [1 << (_BITS - 1 - i) for i in range(_BITS)]
    for dimension, (degree, coefficients, first) in enumerate(_POLYNOMIALS, 1):
        m = list(first)
        for i in range(degree, _BITS):
            value = m[i - degree] ^ (m[i - degree] << degree)
            for k in range(1, degree):
                if coefficients >> (degree - 1 - k) & 1:
                    value ^= m[i - k] << k
            m.append(value)
        table[:, dimension] = [m[i] << (_BITS - 1 - i) for i in range(_BITS)]
    return table.astype(np.uint32)


def hash_u32(x: ArrayLike) -> U32:
    """A well-mixed 32-bit hash (two multiply-xorshift rounds; constants of Wellons' hash-prospector, a search for the
    least bias).
    """
    with np.errstate(over="ignore"):
        h = np.asarray(x, np.uint32)
        h = (h ^ (h >> np.uint32(16))) * np.uint32(0x21F0AAAD)
        h = (h ^ (h >> np.uint32(15))) * np.uint32(0x735A2D97)
        return np.asarray(h ^ (h >> np.uint32(15)), np.uint32)


def pixel_seed(x: ArrayLike, y: ArrayLike, seed: int) -> U32:
    """One seed per pixel, unrelated between neighbours and between runs' seeds."""
    with np.errstate(over="ignore"):
        return hash_u32(np.asarray(x, np.uint32) + hash_u32(np.asarray(y, np.uint32) + hash_u32(np.uint32(seed))))


def reverse_bits(x: ArrayLike) -> U32:
    """Bit 31 becomes bit 0 and so on."""
    v = np.asarray(x, np.uint32)
    for shift, mask in ((1, 0x55555555), (2, 0x33333333), (4, 0x0F0F0F0F), (8, 0x00FF00FF)):
        v = ((v >> np.uint32(shift)) & np.uint32(mask)) | ((v & np.uint32(mask)) << np.uint32(shift))
    return np.asarray((v >> np.uint32(16)) | (v << np.uint32(16)), np.uint32)


def owen_scramble(x: ArrayLike, seed: ArrayLike) -> U32:
    """A random digit scramble in base 2 of 32-bit fractions (Laine and Karras 2011, section 3.1, with the constants of
    Vegdahl 2021, "Building a better LK hash").
    """
    seed = np.asarray(seed, np.uint32)
    with np.errstate(over="ignore"):
        v = reverse_bits(x)
        v = v ^ (v * np.uint32(0x3D20ADEA))
        v = v + seed
        v = v * ((seed >> np.uint32(16)) | np.uint32(1))
        v = v ^ (v * np.uint32(0x05526C56))
        v = v ^ (v * np.uint32(0x53A22864))
        return reverse_bits(v)


def sobol4(index: ArrayLike, seed: ArrayLike) -> NDArray[np.float64]:
    """Point `index` (n,) of the sequence scrambled by `seed` (n,) as (n, 4) in [0, 1), exact multiples of 2^-24."""
    index, seed = np.broadcast_arrays(np.asarray(index, np.uint32), np.asarray(seed, np.uint32))
    bits = np.zeros((*index.shape, 4), np.uint32)
    for bit, direction in enumerate(sobol_directions()):
        bits ^= np.where((index >> np.uint32(bit) & np.uint32(1))[..., None] != 0, direction, np.uint32(0))
    with np.errstate(over="ignore"):
        seeds = np.stack([hash_u32(seed + np.uint32(d)) for d in range(4)], -1)
    return np.asarray((owen_scramble(bits, seeds) >> np.uint32(8)).astype(np.float64) * 2.0**-24)


def r2(index: int) -> tuple[float, float]:
    """Point of the R2 sequence (Roberts 2018) in -0.5..0.5, the first one at the centre: sub-pixel jitter over
    frames.
    """
    plastic = 1.32471795724474602596  # the real root of x^3 = x + 1
    return ((0.5 + index / plastic) % 1.0 - 0.5, (0.5 + index / plastic**2) % 1.0 - 0.5)
