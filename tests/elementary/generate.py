#!/usr/bin/env python3
"""Writes the tables and the test values of fmu/law/src/elementary.rs with mpmath at 400 bits.

    tests/elementary/generate.py            writes tables.rs and fixture.csv
    tests/elementary/generate.py --check    fails where the files differ from what it would write

The tables, by the properties elementary.rs counts on (asserted here):

- LN: the numbers z from 0.6875 to 1.375 in 128 intervals (1/256 wide below 1, 1/128 above). Each holds a reciprocal
  with at most 9 bits, such that r = z * reciprocal - 1 is below 2^-7 and a double holds it exactly; and
  -ln(reciprocal) as a multiple of 2^-42 and a rest.
- EXP: 2^(j/128) rounded, and what the rounding left, relative.
- Polynomials at Chebyshev points: (ln(1+r) - r + r^2/2)/r^3 and (e^r - 1 - r)/r^2.

Every test value is a double-double: its first double is the value rounded to nearest.
"""
import csv
import io
import math
import pathlib
import random
import struct
import sys

import mpmath
from mpmath import mp, mpf

mp.prec = 400
HOME = pathlib.Path(__file__).resolve().parents[2] / "fmu" / "law" / "src" / "elementary"


def number(x):
    """A Rust literal of a double, to the last bit."""
    return repr(float(x))


def on_grid(x, bits):
    """x rounded to a multiple of 2^-bits."""
    return mpmath.nint(x * mpf(2) ** bits) / mpf(2) ** bits


def chebyshev(f, half_width, degree):
    """Coefficients of the polynomial through f at Chebyshev points of (-half_width, half_width)."""
    n = degree + 1
    nodes = [half_width * mpmath.cos(mpmath.pi * (2 * i + 1) / (2 * n)) for i in range(n)]
    rows = mpmath.matrix(n, n)
    for i, x in enumerate(nodes):
        for j in range(n):
            rows[i, j] = x ** j
    solved = mpmath.lu_solve(rows, mpmath.matrix([f(x) for x in nodes]))
    return [solved[j] for j in range(n)]


def ln_rows():
    rows = []
    for i in range(128):
        start = struct.unpack("<d", struct.pack("<Q", 0x3FE6000000000000 + (i << 45)))[0]
        end = struct.unpack("<d", struct.pack("<Q", 0x3FE6000000000000 + ((i + 1) << 45) - 1))[0]
        grid = 128 if start < 1 else 256
        middle = (mpf(start) + mpf(end)) / 2
        reciprocal = mpmath.nint(grid / middle) / grid
        if start <= 1.0 <= end or end == 1 - 2.0 ** -53:
            reciprocal = mpf(1)
        furthest = max(abs(mpf(z) * reciprocal - 1) for z in (start, end))
        assert furthest < mpf(2) ** -7, (i, furthest)
        # multiples of the last bits of z and of the reciprocal, below 2^-7: 53 bits hold them
        assert (53 if start < 1 else 52) + {128: 7, 256: 8}[grid] - 7 <= 53
        value = -mpmath.log(reciprocal)
        assert value == 0 or abs(value) > furthest, i
        high = on_grid(value, 42)
        rows.append((reciprocal, high, value - high))
    return rows


def tables():
    out = io.StringIO()
    say = lambda *a: print(*a, file=out)
    say("//! Tables and polynomials of the elementary functions: written by tests/elementary/generate.py, not by hand.")
    say("#![allow(clippy::approx_constant)] // 2^(64/128) is a row like the others")
    say()
    ln2 = mpmath.log(2)
    high = on_grid(ln2, 42)
    say("/// ln 2: a multiple of 2^-42, and the rest.")
    say(f"pub(super) const LN2: [f64; 2] = [{number(high)}, {number(ln2 - high)}];")
    say()
    say("/// 128/ln 2.")
    say(f"pub(super) const STEPS: f64 = {number(128 / ln2)};")
    say()
    step = ln2 / 128
    high = on_grid(step, 42)
    say("/// ln 2/128: a multiple of 2^-42, and the rest.")
    say(f"pub(super) const STEP: [f64; 2] = [{number(high)}, {number(step - high)}];")
    say()

    def rest_of_ln(r):
        return mpf(1) / 3 if abs(r) < 1e-30 else (mpmath.log(1 + r) - r + r * r / 2) / r ** 3

    def rest_of_exp(r):
        return mpf(1) / 2 if abs(r) < 1e-30 else (mpmath.exp(r) - 1 - r) / r ** 2

    for name, doc, f, width, degree in [
        ("LN_POLY", "(ln(1 + r) - r + r^2/2)/r^3 for |r| < 2^-7, ascending.", rest_of_ln, mpf(2) ** -7, 6),
        ("EXP_POLY", "(e^r - 1 - r)/r^2 for |r| < ln 2/256, ascending.", rest_of_exp, step / 2, 3),
    ]:
        c = chebyshev(f, width, degree)
        say(f"/// {doc}")
        say("#[rustfmt::skip]")
        say(f"pub(super) const {name}: [f64; {len(c)}] = [")
        for x in c:
            say(f"    {number(x)},")
        say("];")
        say()
    say("/// Reciprocal 1/c and ln c (a multiple of 2^-42, and the rest), an interval each.")
    say("#[rustfmt::skip]")
    say("pub(super) static LN: [[f64; 3]; 128] = [")
    for row in ln_rows():
        say("    [" + ", ".join(number(x) for x in row) + "],")
    say("];")
    say()
    say("/// 2^(j/128) rounded, and the rest relative to it.")
    say("#[rustfmt::skip]")
    say("pub(super) static EXP: [[f64; 2]; 128] = [")
    for j in range(128):
        exact = mpf(2) ** (mpf(j) / 128)
        high = mpf(float(exact))
        say(f"    [{number(high)}, {number((exact - high) / high)}],")
    say("];")
    return out.getvalue()


def bits(x):
    return f"{struct.unpack('<Q', struct.pack('<d', float(x)))[0]:016x}"


def to_double(value):
    """The double nearest to a positive or negative mpf, subnormals and overflow included."""
    if value == 0:
        return 0.0
    sign, size = (-1.0 if value < 0 else 1.0), abs(value)
    exponent = max(int(mpmath.floor(mpmath.log(size, 2))) - 52, -1074)
    whole = int(mpmath.nint(size / mpf(2) ** exponent))
    if mpf(whole) * mpf(2) ** exponent >= mpf(2) ** 1024:
        return sign * float("inf")
    return sign * math.ldexp(whole, exponent)


def fixture():
    rng = random.Random(20050611)
    cases = []

    def add(name, x, y, value):
        high = to_double(value)
        low = 0.0 if high in (float("inf"), float("-inf")) else float(value - mpf(high))
        cases.append((name, bits(x), bits(y), bits(high), bits(low)))

    def power(x, p):
        add("pow", x, p, mpf(x) ** mpf(p))

    for _ in range(300):  # penetrations and exponents of contacts
        power(10 ** rng.uniform(-9, 0), rng.uniform(0.05, 6))
    for p in (0.5, 1.0, 1.5, 2.0, 2.5, 3.0, 3.5, 4.0):
        for _ in range(50):
            power(10 ** rng.uniform(-9, 3), p)
        for _ in range(10):
            power(2.0 ** rng.randint(-190, 190) * rng.uniform(1, 2), p)
        power(2.0 ** -250 * 1.7, p)
        power(2.0 ** 220 * 1.3, p)
    for _ in range(200):  # everywhere: results from the smallest subnormal to the largest double
        x = 2.0 ** rng.uniform(-1000, 1000)
        power(x, rng.uniform(-744, 709) / float(mpmath.log(x)))
    for _ in range(100):  # beside 1, where only a relative error counts
        x = 1 + rng.choice((-1, 1)) * 2.0 ** rng.uniform(-52, -2)
        power(x, rng.uniform(-740, 705) / float(mpmath.log(x)))
    for _ in range(30):  # subnormal arguments
        power(rng.randint(1, 2 ** 52) * 2.0 ** -1074, rng.uniform(-0.9, 1.0))
    for _ in range(60):  # subnormal results
        add("exp", x := rng.uniform(-745, -708), 0.0, mpmath.exp(mpf(x)))
        x = 10 ** rng.uniform(-9, -1)
        power(x, rng.uniform(-745, -709) / float(mpmath.log(x)))
    for _ in range(200):
        x = rng.choice((-1, 1)) * 2.0 ** rng.uniform(-60, 9.4)
        add("exp", x, 0.0, mpmath.exp(mpf(x)))
        add("exp_m1", x, 0.0, mpmath.expm1(mpf(x)))
        x = rng.uniform(-2, 2)
        add("exp_m1", x, 0.0, mpmath.expm1(mpf(x)))
        x = 2.0 ** rng.uniform(-1074, 1023)
        add("ln", x, 0.0, mpmath.log(mpf(x)))
        x = rng.uniform(0.5, 2)
        add("ln", x, 0.0, mpmath.log(mpf(x)))
        x = 2.0 ** rng.uniform(-80, 80)
        add("ln_1p", x, 0.0, mpmath.log1p(mpf(x)))
        x = -(2.0 ** rng.uniform(-80, 0))
        add("ln_1p", x, 0.0, mpmath.log1p(mpf(x)))
    for _ in range(100):
        x = rng.choice((-1, 1)) * 2.0 ** rng.uniform(-60, 9.4)
        add("sinh", x, 0.0, mpmath.sinh(mpf(x)))
        add("cosh", x, 0.0, mpmath.cosh(mpf(x)))
        x = rng.choice((-1, 1)) * 2.0 ** rng.uniform(-60, 600)
        add("asinh", x, 0.0, mpmath.asinh(mpf(x)))
        x = rng.choice((-1, 1)) * 2.0 ** rng.uniform(-4, 4)
        add("asinh", x, 0.0, mpmath.asinh(mpf(x)))
    for _ in range(200):
        x = rng.choice((-1, 1)) * 2.0 ** rng.uniform(-60, 4.6)
        add("tanh", x, 0.0, mpmath.tanh(mpf(x)))
    out = io.StringIO()
    write = csv.writer(out, lineterminator="\n")
    write.writerow(["function", "x", "y", "value", "rest"])
    write.writerows(cases)
    return out.getvalue()


def main():
    same = True
    for name, text in (("tables.rs", tables()), ("fixture.csv", fixture())):
        path = HOME / name
        if "--check" in sys.argv[1:]:
            if path.read_text() != text:
                print(f"{path.name} is not what tests/elementary/generate.py writes with mpmath {mpmath.__version__}")
                same = False
        else:
            path.write_text(text)
    sys.exit(0 if same else 1)


main()
