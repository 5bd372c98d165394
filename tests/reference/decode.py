#!/usr/bin/env python3
"""A decoder written from docs/RELIEF_patch_compression/bitstream.md alone: slow, and in its order. The section numbers
are those of that document.

  decode.py [--limits PATCHES PIXELS VERTICES] [--smooth] [--points] [--level L] [--patches BITS] FILE...

prints for each file a line: the SHA-256 of positions, normals and indices, or the number of the error. Patch i is decoded if
the (i mod their number)-th of the bits is 1.
"""
import hashlib
import json
import math
import os
import struct
import sys

TABLES = json.load(open(os.path.join(os.path.dirname(os.path.abspath(__file__)),
                                     '../../docs/RELIEF_patch_compression/tables.json')))
ARGUMENT, TRUNCATED, MAGIC, VERSION, CORRUPT, LIMIT, WORKSPACE, OUTPUT = range(1, 9)


class Error(Exception):
    pass


# --- 1 Conventions ---

_single = struct.Struct('<f')


def f32(x):
    """The nearest float. Sums, products, quotients and square roots of floats come out right via double (Figueroa)."""
    return _single.unpack(_single.pack(x))[0]


def quotient(a, b):  # rounds towards zero
    return abs(a) // b if a >= 0 else -(abs(a) // b)


def root(v):
    return int(math.sqrt(float(v)))


def clamp(x, m):
    return max(-m, min(m, x))


def dot(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a, b):
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def minus(a, b):
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])


def unit(v):
    x, y, z = map(float, v)
    t = x * x + y * y + z * z
    f = 4096.0 / math.sqrt(t) if t > 0 else 0.0
    return tuple(int(c * f) for c in (x, y, z))


# --- 2 Container ---

class Stream:
    def __init__(self, data, limits):
        max_patches, max_pixels, max_vertices = limits
        self.data = data
        if data[:3] != b'RLF'[:len(data[:3])]:
            raise Error(MAGIC)
        if len(data) > 3 and data[3] != 0:
            raise Error(VERSION)
        if len(data) < 29:
            raise Error(TRUNCATED)
        self.flags = data[4]
        *self.origin, self.scale, self.spacing, self.step = struct.unpack_from('<6f', data, 5)
        at = 29
        counts = []
        for _ in range(12 if self.flags & 4 else 8):
            value, at, good = varint(data, at)
            if not good:
                raise Error(TRUNCATED if at == len(data) else CORRUPT)
            counts.append(value)
        (self.patch_count, self.mask_pixels, self.boundary_nodes, self.vertex_count, self.triangle_count,
         table, coefficients, seams) = counts[:8]
        self.colour_step, *colours = counts[8:] or (256, 0, 0, 0)
        if (self.flags & ~7 or not 16 <= self.colour_step <= 1 << 16
                or not all(-f32(1e37) <= o <= f32(1e37) for o in self.origin) or not f32(1e-30) <= self.scale <= f32(1e30) or not 1 <= self.spacing <= 1 << 20
                or not 1 / 64 <= self.step <= 1 << 20 or self.patch_count == 0
                or self.boundary_nodes > self.mask_pixels or self.mask_pixels < 3):
            raise Error(CORRUPT)
        if (self.patch_count > max_patches or self.mask_pixels > max_pixels or self.vertex_count > max_vertices
                or self.mask_pixels > max_vertices):
            raise Error(LIMIT)
        if self.patch_count > table:
            raise Error(CORRUPT)
        self.table = data[at:at + table]
        self.masks_cut = table > len(self.table)
        at += table
        left = max(0, len(data) - at)
        self.cut = coefficients + seams > left
        if coefficients + seams + sum(colours) < left:
            raise Error(CORRUPT)
        self.coefficients = data[at:at + coefficients]
        self.coefficients_cut = coefficients > left
        at += coefficients
        self.seams = None if self.cut else data[at:at + seams]
        at += seams
        self.colours = []  # for each channel: its bytes, whether some are missing
        for size in colours:
            self.colours.append((data[at:at + size], size > max(0, len(data) - at)))
            at += size


def varint(data, at):
    value = 0
    for i in range(5):
        if at == len(data):
            return 0, at, False
        byte = data[at]
        at += 1
        if i == 4 and byte > 15:
            return 0, at, False
        value |= (byte & 127) << 7 * i
        if byte < 128:
            return value, at, True
    return 0, at, False


# --- 3 Range decoder, 4 Models ---

class Coder:
    def __init__(self, data, cut=False):
        self.data, self.at, self.cut, self.missing = data, 0, cut, False
        self.range, self.code = 0xffffffff, 0
        for _ in range(4):
            self.code = self.code << 8 | self.byte()

    def byte(self):
        if self.at < len(self.data):
            self.at += 1
            return self.data[self.at - 1]
        self.missing = True
        return 0

    def exhausted(self):
        return self.cut and self.missing

    def left(self):
        return len(self.data) - self.at

    def bit(self, p):
        bound = (self.range >> 16) * p
        if self.code < bound:
            self.range, b = bound, 1
        else:
            self.code -= bound
            self.range -= bound
            b = 0
        while self.range < 1 << 24:
            self.range <<= 8
            self.code = (self.code << 8 & 0xffffffff) | self.byte()
        return b

    def raw(self):
        return self.bit(32768)

    def adaptive(self, m, limit):
        b = self.bit(p16(m))
        update(m, limit, b)
        return b

    def golomb(self, models):
        n = 0
        while n < 20 and self.adaptive(models[min(n, 19)], 80):
            n += 1
        v = 1
        for i in range(n - 1, -1, -1):
            v = 2 * v + (self.adaptive(models[20 + min(i, 19)], 80) if i == n - 1 else self.raw())
        return v - 1

    def signed(self, models):
        z = self.golomb(models)
        return -(z >> 1) - 1 if z & 1 else z >> 1

    def mixed(self, m, w, limit, rate):
        s = [STRETCH[p16(one) >> 4] for one in m]
        p12 = squash(clamp(sum(a * b for a, b in zip(w, s)) >> 16, 2047))
        b = self.bit(p12 * 16)
        e = (b * 4096 - p12) * 16
        for i, one in enumerate(m):
            w[i] = (w[i] + (s[i] * e + (1 << rate - 1) >> rate) + (1 << 31)) % (1 << 32) - (1 << 31)
            update(one, limit, b)
        return b


def fresh():
    return [1 << 21, 0]


def guess(p, n):
    return [p * 64, n]


def fresh_set():
    return [fresh() for _ in range(40)]


def p16(m):
    return max(32, min(65504, m[0] >> 6))


def update(m, limit, b):
    m[0] += ((1 << 22) - 1 - m[0] if b else -m[0]) * (655360 // (10 * m[1] + 16)) >> 16
    if m[1] < limit:
        m[1] += 1


KNOT = TABLES['logistic_knots']


def squash(x):
    j, k = x & 127, (x >> 7) + 16
    return KNOT[k] * (128 - j) + KNOT[k + 1] * j + 64 >> 7


def make_stretch():
    table = []
    for x in range(-2047, 2048):
        while len(table) <= squash(x):
            table.append(x)
    return table + [2047] * (4096 - len(table))


STRETCH = make_stretch()


# --- 5 Patch table ---

class Patch:
    pass


def power(i):
    return (1.0, 1.189207115002721, 1.4142135623730951, 1.681792830507429)[i & 3] * 2.0 ** (i >> 2)


def read_table(stream, coder, limits):
    sets = {name: fresh_set() for name in ('width', 'height', 'x0', 'y0', 'z0', 'spacing', 'step')}
    patches = []
    pixels = planes = largest = 0
    for i in range(stream.patch_count):
        p = Patch()
        raw8 = lambda: sum(coder.raw() << k for k in range(7, -1, -1)) - 127
        p.u = raw8()
        p.v = raw8()
        spacing_index = coder.golomb(sets['spacing'])
        step_index = coder.signed(sets['step'])
        p.width = 1 + coder.golomb(sets['width'])
        p.height = 1 + coder.golomb(sets['height'])
        p.x0, p.y0, p.z0 = (coder.signed(sets[k]) for k in ('x0', 'y0', 'z0'))
        if coder.exhausted():
            raise Error(TRUNCATED)
        if p.u > 127 or p.v > 127 or spacing_index > 63 or abs(step_index) > 31 or max(p.width, p.height) > 1 << 15:
            raise Error(CORRUPT)
        p.spacing = f32(stream.spacing * power(-spacing_index))
        p.step = f32(stream.step * power(step_index))
        pixels += p.width * p.height
        largest = max(largest, p.width * p.height)
        planes += sum((w + 4) * (h + 4) for w, h in sizes(p.width, p.height).values())
        if pixels > limits[1] or planes > 8 * limits[1] + 640 * (i + 1):
            raise Error(LIMIT)
        patches.append(p)
    if stream.mask_pixels > pixels:
        raise Error(CORRUPT)
    stream.memory = ((1 << 23) + 320 * stream.patch_count + 5 * planes + 80 * largest + 116 * stream.mask_pixels
                     + 1200 * stream.boundary_nodes)
    if stream.flags & 4:
        stream.memory += (1 << 20) + 12 * planes + 6 * largest + 4 * (stream.mask_pixels + 7 * stream.boundary_nodes)
    return patches


# --- 6 Masks ---

C5 = ((-2, 0), (-1, -1), (0, -1), (1, -1), (0, -2))
C9 = ((-2, 0), (-2, -1), (-1, -1), (0, -1), (1, -1), (2, -1), (-1, -2), (0, -2), (1, -2))
C12 = ((-2, 0),) + tuple((x, -1) for x in range(-2, 4)) + tuple((x, -2) for x in range(-2, 3))
C15 = C9 + ((-3, 0), (3, -1), (-3, -1), (2, -2), (-2, -2), (0, -3))
C21 = (tuple((-x, 0) for x in range(1, 5)) + tuple((x, -1) for x in range(-3, 5))
       + tuple((x, -2) for x in range(-3, 4)) + tuple((x, -3) for x in range(-1, 2)))


class Lazy(dict):
    """A table of which few entries are ever used."""

    def __init__(self, make):
        super().__init__()
        self.make = make

    def __missing__(self, key):
        self[key] = value = self.make(key)
        return value


class MaskModels:
    def __init__(self):
        self.t5, self.t12, self.t21 = (Lazy(lambda _: fresh()) for _ in range(3))
        self.weights = Lazy(lambda _: [30000] * 3)
        self.deep, self.group, self.in_group = fresh(), fresh(), [fresh() for _ in range(7)]


def read_mask(coder, models, width, height):
    rows = [[0] * (width + 8) for _ in range(height + 3)]
    for y in range(height):
        row = rows[y + 3]

        def context(x, pixels):
            return sum((rows[y + 3 + dy][x + 4 + dx] ^ row[x + 3]) << i for i, (dx, dy) in enumerate(pixels))

        def group_follows(x):
            before = row[x + 3]
            if x + 8 > width:
                return False
            row[x + 4:x + 12] = [before] * 8
            return all(context(i, C15) == 0 for i in range(x, x + 8))
        x, deep = 0, False
        while x < width:
            w = row[x + 3]
            if deep and group_follows(x):  # which has made them all as w
                if coder.adaptive(models.group, 255):
                    i = 0
                    while i < 7 and not coder.adaptive(models.in_group[i], 255):
                        i += 1
                    row[x + 4 + i] = 1 - w
                    x += i + 1
                    deep = False
                else:
                    x += 8
                continue
            c15 = context(x, C15)
            if c15 == 0:
                differs = coder.adaptive(models.deep, 255)
            else:
                c9, c21 = context(x, C9), context(x, C21)
                m = (models.t5[context(x, C5)], models.t12[context(x, C12)],
                     models.t21[(c21 * 0x9E3779B1 & 0xffffffff) >> 18])
                differs = coder.mixed(m, models.weights[c9], 255, 14)
            row[x + 4] = w ^ differs
            deep = c15 == 0 and not differs
            x += 1
    return [row[4:4 + width] for row in rows[3:]]


# --- 7 Bands ---

LEVELS = 5


def sizes(w, h):
    """By ('low', l) and (type, l)."""
    all = {('low', 0): (w, h)}
    for l in range(LEVELS):
        all[0, l] = (w // 2, (h + 1) // 2)
        all[1, l] = ((w + 1) // 2, h // 2)
        all[2, l] = (w // 2, h // 2)
        w, h = (w + 1) // 2, (h + 1) // 2
        all['low', l + 1] = (w, h)
    return all


class Plane:
    """Values by (x, y), with a margin of zeros."""

    def __init__(self, width, height, rows=None):
        self.width, self.height = width, height
        self.rows = rows or [[0] * width for _ in range(height)]

    def __call__(self, x, y):
        return self.rows[y][x] if 0 <= x < self.width and 0 <= y < self.height else 0


def even(s):
    at = lambda i: s[i] if i < len(s) else 0
    return [int(at(2 * k) or (at(2 * k + 1) and not at(2 * k + 2))) for k in range((len(s) + 1) // 2)]


def odd(s):
    at = lambda i: s[i] if i < len(s) else 0
    return [int(s[2 * k + 1] and (at(2 * k) or at(2 * k + 2))) for k in range(len(s) // 2)]


def columns(rows, width):
    return [[row[x] for row in rows] for x in range(width)]


def transposed(cols, height):
    return [[col[y] for col in cols] for y in range(height)]


def make_masks(patch):
    size = sizes(patch.width, patch.height)
    patch.halves = {}
    for l in range(LEVELS):
        s = patch.mask['low', l]
        lo = [even(row) for row in s.rows]
        hi = [odd(row) for row in s.rows]
        patch.halves[l] = lo, hi
        lo_columns, hi_columns = columns(lo, (s.width + 1) // 2), columns(hi, s.width // 2)
        for key, cols, way in ((('low', l + 1), lo_columns, even), ((1, l), lo_columns, odd),
                               ((0, l), hi_columns, even), ((2, l), hi_columns, odd)):
            w, h = size[key]
            patch.mask[key] = Plane(w, h, transposed([way(c) for c in cols], h))


# --- 8 Coefficients ---

WEIGHTS = TABLES['activity_weights']


def moved(p16, steps):
    return 16 * squash(clamp(STRETCH[p16 >> 4] + 8 * steps, 2047))


def first_greater(activity, k):
    return 256 * TABLES['first_greater'][activity][min(k, 3) - 1]


def expected(near, t):
    k = WEIGHTS[t]
    return (k['W'] * (near & 3) + k['N'] * (near >> 2 & 3) + k['NW'] * (near >> 4 & 1) + k['NE'] * (near >> 5 & 1)
            + (k['WW'] + k['NN']) * (near >> 6) // 2)


def guessed_set(prefix):
    return [guess(256 * (prefix[i] if i < 14 else 40 if i < 20 else 100), 15) for i in range(40)]


class CoefficientModels:
    def __init__(self):
        nonzero, nonzero_move, greater_move = (TABLES[n] for n in ('first_nonzero', 'nonzero_move', 'greater_move'))
        self.low_zero = [guess(256 * 254, 15) for _ in range(2)]
        self.low = [guessed_set(TABLES['first_low']) for _ in range(2)]
        self.zero = Lazy(lambda k: guess(moved(nonzero[k[0]][k[1]], nonzero_move[k[0]][k[2]][k[3]][k[4]]), 12))
        self.zero_near = Lazy(lambda k: guess(nonzero[k[0]][activity_class(6 * expected(k[1], k[2]) >> 2)], 4))
        self.greater = Lazy(lambda k: guess(moved(first_greater(k[0], k[2]), greater_move[k[1]]), 12))
        self.greater_near = Lazy(lambda k: guess(first_greater(activity_class(expected(k[0], k[1])), k[2]), 4))
        self.sign = Lazy(lambda k: guess(256 * TABLES['first_sign'][k[0]][k[1]], 30))
        self.zero_weights, self.greater_weights = (Lazy(lambda _: [52000, 18000]) for _ in range(2))
        self.tail = [guessed_set(prefix) for prefix in TABLES['first_tail']]


class Exhausted(Exception):
    pass


def read_low(coder, models, patch):
    q, m = patch.q['low', LEVELS], patch.mask['low', LEVELS]
    for y in range(q.height):
        for x in range(q.width):
            if not m(x, y):
                continue
            W, N, NW = q(x - 1, y), q(x, y - 1), q(x - 1, y - 1)
            if m(x - 1, y) and m(x, y - 1):
                prediction = quotient(3 * (W + N) - 2 * NW, 4) if m(x - 1, y - 1) else quotient(W + N, 2)
            else:
                prediction = next((q(*n) for n in ((x - 1, y), (x, y - 1), (x + 1, y - 1), (x - 1, y - 1)) if m(*n)), 0)
            c = 1 if m(x - 1, y) or m(x, y - 1) else 0
            r = 0
            if coder.adaptive(models.low_zero[c], 80):
                negative = coder.raw()
                k = 1 + coder.golomb(models.low[c])
                r = -k if negative else k
            if coder.exhausted():
                raise Exhausted
            q.rows[y][x] = clamp(prediction + r, 1 << 26)


def activity_class(e):
    if e < 2:
        return e
    o = e.bit_length() - 1
    return min(19, 2 * o + (e >> o - 1 & 1))


def sgn(v):
    return (v > 0) - (v < 0)


def next_state(state, k):
    return state >> 1 ^ (18 if state & 1 else 0) ^ (4 if k & 1 else 0)


def coded_magnitude(q):
    return abs(q) + 1 >> 1


def read_band(coder, models, patch, l, t):
    q, m, k = patch.q[t, l], patch.mask[t, l], WEIGHTS[t]
    A = lambda plane, x, y: coded_magnitude(plane(x, y))
    s = min(l, 2)
    state = 0

    def around(plane, x, y, weights):
        here, across, down = weights
        return (here * A(plane, x, y) + across * (A(plane, x - 1, y) + A(plane, x + 1, y))
                + down * (A(plane, x, y - 1) + A(plane, x, y + 1)))

    for y in range(q.height):
        for x in range(q.width):
            if not m(x, y):
                continue
            near = {'W': A(q, x - 1, y), 'N': A(q, x, y - 1), 'NW': A(q, x - 1, y - 1), 'NE': A(q, x + 1, y - 1),
                    'WW': A(q, x - 2, y), 'NN': A(q, x, y - 2)}
            e = sum(k[name] * near[name] for name in near)
            if l < LEVELS - 1:
                up = patch.q[t, l + 1]
                if up.width and up.height:
                    e += around(up, min(x // 2, up.width - 1), min(y // 2, up.height - 1), k['parent'])
            for i in range(t):
                sibling = patch.q[i, l]
                if x < sibling.width and y < sibling.height:
                    e += around(sibling, x, y, k['siblings'][i])
            edge = m(x - 1, y) + m(x + 1, y) + m(x, y - 1) + m(x, y + 1) + m(x + 1, y - 1) < 5
            e = min(e, 1 << 22)
            if edge:
                e = e * 205 >> 6
            activity = activity_class(e >> 2)
            near = (min(near['W'], 3) + 4 * min(near['N'], 3) + 16 * min(near['NW'], 1) + 32 * min(near['NE'], 1)
                    + 64 * min(near['WW'] + near['NN'], 3))
            sign_context = 3 * sgn(q(x, y - 1)) + sgn(q(x - 1, y)) + 4
            u = state & 1

            def coded(first, second, w):
                return coder.adaptive(first, 80) if activity == 0 else coder.mixed((first, second), w, 255, 15)

            if not coded(models.zero[u, activity, t, s, edge], models.zero_near[u, near, t],
                         models.zero_weights[u, activity]):
                state = next_state(state, 0)
                continue
            negative = coder.adaptive(models.sign[t, sign_context], 80)
            n = 1
            while n < 15 and coded(models.greater[activity, s, n], models.greater_near[near % 64, t, n],
                                   models.greater_weights[activity, min(n, 5) - 1]):
                n += 1
            if n == 15:
                n += coder.golomb(models.tail[1 if activity == 19 else 0])
            state = next_state(state, n)
            q.rows[y][x] = -(2 * n - u) if negative else 2 * n - u
        if coder.exhausted():
            q.rows[y] = [0] * q.width
            raise Exhausted


def read_subband(coder, patches):
    models = CoefficientModels()
    try:
        for p in patches:
            read_low(coder, models, p)
        for l in range(LEVELS - 1, -1, -1):
            for p in patches:
                for t in range(3):
                    read_band(coder, models, p, l, t)
    except Exhausted:
        pass


class Set:
    def __init__(self, band, x, y, width, height, depth):
        self.band, self.x, self.y, self.width, self.height, self.depth = band, x, y, width, height, depth

    def shrink(self, mask):
        inside = [(x, y) for y in range(self.y, self.y + self.height) for x in range(self.x, self.x + self.width)
                  if mask(x, y)]
        if not inside:
            return False
        xs, ys = [x for x, _ in inside], [y for _, y in inside]
        self.x, self.y = min(xs), min(ys)
        self.width, self.height = max(xs) - self.x + 1, max(ys) - self.y + 1
        return True

    def halves(self):
        if self.width >= self.height:
            w = (self.width + 1) // 2
            return (Set(self.band, self.x, self.y, w, self.height, self.depth + 1),
                    Set(self.band, self.x + w, self.y, self.width - w, self.height, self.depth + 1))
        h = (self.height + 1) // 2
        return (Set(self.band, self.x, self.y, self.width, h, self.depth + 1),
                Set(self.band, self.x, self.y + h, self.width, self.height - h, self.depth + 1))


class Bisk:
    def __init__(self, coder, patches):
        self.coder = coder
        self.planes, self.more, self.set, self.single, self.sign, self.refined = (
            Lazy(lambda _: fresh()) for _ in range(6))
        self.keys = [('low', LEVELS)] + [(t, l) for l in range(LEVELS - 1, -1, -1) for t in range(3)]
        for p in patches:
            p.lists = [[] for _ in range(29)]
            p.found = []
            for band, key in enumerate(self.keys):
                s = Set(band, 0, 0, p.mask[key].width, p.mask[key].height, 0)
                if s.shrink(p.mask[key]):
                    p.lists[0].append(s)
        try:
            self.read(patches)
        except Exhausted:
            pass

    def step(self, k):
        if self.coder.left() < k:
            raise Exhausted

    def read(self, patches):
        for p in patches:
            self.step(10)
            n = 1
            for _ in range(5):
                n = 2 * n + self.coder.adaptive(self.planes[n], 255)
            p.plane, p.refining, p.before = min(n - 32, 26) - 1, False, 0
        for _ in range(64):
            for p in patches:
                made = 0
                while p.plane >= 0:
                    self.step(4)
                    if not self.coder.adaptive(self.more[min(made, 2), min(p.before, 2)], 255):
                        break
                    made += 1
                    self.missing = ((1 << p.plane) - 1) * 7 >> 4
                    if p.refining:
                        self.refine(p)
                        p.plane -= 1
                    else:
                        self.find(p)
                    p.refining = not p.refining
                p.before = made

    def find(self, p):
        for d in range(28, -1, -1):
            for s in list(p.lists[d]):
                self.step(4)
                if self.test(p, s, 0):
                    p.lists[d].remove(s)
                    self.open(p, [s])

    def open(self, p, stack):
        while stack:
            self.step(4)
            s = stack.pop()
            if s.width == s.height == 1:
                q = p.q[self.keys[s.band]]
                of_two = lambda v, w: sgn(sgn(v) + sgn(w))
                context = (3 * of_two(q(s.x, s.y - 1), q(s.x, s.y + 1)) + of_two(q(s.x - 1, s.y), q(s.x + 1, s.y)) + 4)
                negative = self.coder.adaptive(self.sign[self.type(s), context], 255)
                v = (1 << p.plane) + self.missing
                q.rows[s.y][s.x] = -v if negative else v
                p.found.insert(0, s)
                continue
            a, b = s.halves()
            a.shrink(p.mask[self.keys[s.band]])
            b.shrink(p.mask[self.keys[s.band]])
            first = self.test(p, a, 1)
            second = self.test(p, b, 2) if first else 1
            for half, has in ((b, second), (a, first)):
                if has:
                    stack.append(half)
                else:
                    p.lists[half.depth].insert(0, half)

    def refine(self, p):
        for s in p.found:
            q = p.q[self.keys[s.band]]
            old = q(s.x, s.y)
            v = abs(old) >> p.plane + 1
            if v:
                self.step(4)
                v = 2 * v + self.coder.adaptive(self.refined[self.around(p, s) if v == 1 else 12], 255)
                q.rows[s.y][s.x] = sgn(old) * ((v << p.plane) + self.missing)

    def type(self, s):
        return 3 if s.band == 0 else (s.band - 1) % 3

    def test(self, p, s, role):
        if s.width == s.height == 1:
            return self.coder.adaptive(self.single[role, self.type(s) == 2, self.around(p, s)], 255)
        size = min(11, (s.width * s.height).bit_length() - 1)
        return self.coder.adaptive(self.set[role, size, self.around_set(p, s)], 255)

    def above(self, p, s, x, y):
        up = p.q[self.keys[s.band - 3]] if s.band > 3 else None
        return abs(up(min(x // 2, up.width - 1), min(y // 2, up.height - 1))) if up and up.width and up.height else 0

    def around(self, p, s):
        x, y = s.x, s.y
        A = lambda dx, dy: abs(p.q[self.keys[s.band]](x + dx, y + dy))
        e = (2 * (A(-1, 0) + A(1, 0) + A(0, -1) + A(0, 1)) + A(-1, -1) + A(1, -1) + A(-1, 1) + A(1, 1)
             + self.above(p, s, x, y))
        return min(11, activity_class(e >> p.plane))

    def around_set(self, p, s):
        A = lambda x, y: abs(p.q[self.keys[s.band]](x, y))
        x, y = s.x + s.width // 2, s.y + s.height // 2
        e = (A(s.x - 1, y) + A(s.x + s.width, y) + A(x, s.y - 1) + A(x, s.y + s.height) + self.above(p, s, x, y))
        e >>= p.plane
        return e if e < 2 else 2 if e < 4 else 3


def read_coefficients(stream, patches):
    for p in patches:
        p.q = {key: Plane(w, h) for key, (w, h) in sizes(p.width, p.height).items()}
    coder = Coder(stream.coefficients, stream.coefficients_cut)
    if stream.flags & 2:
        Bisk(coder, patches)
    else:
        read_subband(coder, patches)


# --- 9 Heights ---

LIFT = [f32(float(x)) for x in TABLES['lifting']]
LOW_SCALE = f32(float(TABLES['low_scale']))
HIGH_SCALE = f32(1 / LOW_SCALE)
COARSE = f32(HIGH_SCALE * HIGH_SCALE)
DETAIL = f32(LOW_SCALE * LOW_SCALE)
ALONE = f32(f32(0.70710678) * LOW_SCALE)
ONE = f32(1.2)


def value(q, d):
    return f32(f32(float(q)) * (f32(ONE * d) if abs(q) == 1 else d))


def lift(v, mask):
    """All segments of a line, in place."""
    x = 0
    while x < len(v):
        if not mask[x]:
            x += 1
            continue
        begin = x
        while x < len(v) and mask[x]:
            x += 1
        if x - begin == 1:
            v[begin] = f32(v[begin] * ALONE)
        else:
            lift_segment(v, begin, x)


def lift_segment(v, begin, end):
    for i in (3, 2, 1, 0):
        for x in range(begin + ((begin ^ (i + 1)) & 1), end, 2):
            def neighbour(way):
                if begin <= x + way < end:
                    return v[x + way]
                a = v[x - way]
                if i == 3 or not begin <= x - 3 * way < end:
                    return a
                return f32(a + f32(a - v[x - 3 * way]))
            v[x] = f32(v[x] + f32(-LIFT[i] * f32(neighbour(-1) + neighbour(1))))


def alone(mask, x):
    return not (x > 0 and mask[x - 1]) and not (x + 1 < len(mask) and mask[x + 1])


def merged(low, high, mask):
    """A line from its two halves, lifted."""
    v = [0.0] * len(mask)
    for x, inside in enumerate(mask):
        if inside:
            v[x] = high[x // 2] if x & 1 and not alone(mask, x) else low[x // 2]
    lift(v, mask)
    return v


def heights(patch, level):
    z = inverse(patch, patch.step, level)
    return z if level else restored(patch, z)


def at_most(m, limit):
    m = m if m > -limit else -limit
    return m if m < limit else limit


def move(z, limit, a, b):
    """a, b: up to three samples from z on, None where they are not in the mask."""
    if a[0] is None:
        a, b = b, a
    if a[0] is not None and b[0] is not None:
        if a[1] is None:
            a, b = b, a
        if a[1] is None:
            return 0.0
        if b[1] is not None:
            inner = f32(f32(f32(a[0] + b[0]) * 4) - f32(a[1] + b[1]))
            return at_most(f32(f32(inner - f32(z * 6)) * 0.125), limit)
        inner = f32(f32(b[0] + f32(a[0] * 3)) - a[1])
        return at_most(f32(f32(inner - f32(z * 3)) * f32(1 / 6)), f32(limit * 2))
    if None in a:
        return 0.0
    return at_most(f32(f32(f32(f32(a[0] - a[1]) * 3) + a[2]) - z), limit)


def restored(patch, z):
    mask, limit = patch.mask['low', 0], f32(f32(0.11) * patch.step)
    out = [row[:] for row in z]
    for y in range(mask.height):
        for x in range(mask.width):
            if mask(x, y):
                def line(dx, dy):
                    return [z[y + k * dy][x + k * dx] if mask(x + k * dx, y + k * dy) else None for k in (1, 2, 3)]
                out[y][x] = f32(z[y][x] + f32(move(z[y][x], limit, line(-1, 0), line(1, 0)) +
                                              move(z[y][x], limit, line(0, -1), line(0, 1))))
    return out


def inverse(patch, D, level):
    low = [[value(q, f32(D * COARSE)) for q in row] for row in patch.q['low', LEVELS].rows]
    for l in range(LEVELS - 1, level - 1, -1):
        d_high = f32(D * f32((1.35, 1.0)[l] if l < 2 else 1.0))
        d_both = f32(f32(D * f32((1.8, 1.1)[l] if l < 2 else 1.0)) * DETAIL)
        HL = [[value(q, d_high) for q in row] for row in patch.q[0, l].rows]
        LH = [[value(q, d_high) for q in row] for row in patch.q[1, l].rows]
        HH = [[value(q, d_both) for q in row] for row in patch.q[2, l].rows]
        mask = patch.mask['low', l]
        halves = []
        for (even_rows, odd_rows), half, width in (((low, LH), patch.halves[l][0], (mask.width + 1) // 2),
                                                   ((HL, HH), patch.halves[l][1], mask.width // 2)):
            cols = [merged(a, b, m) for a, b, m in
                    zip(columns(even_rows, width), columns(odd_rows, width), columns(half, width))]
            halves.append(transposed(cols, mask.height))
        low = [merged(a, b, m) for a, b, m in zip(halves[0], halves[1], mask.rows)]
        if l > level:
            low = [[f32(z * COARSE) for z in row] for row in low]
    return [[f32(z * 0.5 ** level) for z in row] for row in low]


# --- 14 Coarser levels ---

def good(mask, x, y):
    def covered(cx, cy):
        return mask(cx, cy) + mask(cx + 1, cy) + mask(cx, cy + 1) + mask(cx + 1, cy + 1) >= 3
    cells = [covered(x, y), covered(x - 1, y), covered(x - 1, y - 1), covered(x, y - 1)]
    sides = [mask(x + 1, y), mask(x, y + 1), mask(x - 1, y), mask(x, y - 1)]  # before each cell
    fans = sum(cells[k] and not (cells[k - 1] and sides[k]) for k in range(4))
    return any(cells) and fans < 2


def tidy(mask):
    for first in [(x, y) for y in range(mask.height) for x in range(mask.width)]:
        stack = [first] if mask(*first) else []
        while stack:
            x, y = stack.pop()
            if good(mask, x, y):
                continue
            mask.rows[y][x] = 0
            for dx, dy in ((1, 0), (1, 1), (0, 1), (-1, 1), (-1, 0), (-1, -1), (0, -1), (1, -1)):
                if mask(x + dx, y + dy) and (x + dx, y + dy) not in stack:
                    stack.append((x + dx, y + dy))


# --- 10 Vertices ---

def frame(u, v):
    k = 1.0 / 127
    x, y = u * k, v * k
    z = 1 - abs(x) - abs(y)
    if z < 0:
        x, y = (1 - abs(y)) * (-1 if x < 0 else 1), (1 - abs(x)) * (-1 if y < 0 else 1)
    l = math.sqrt(x * x + y * y + z * z)
    n = (x / l, y / l, z / l)
    c = cross(n, (1.0, 0.0, 0.0) if abs(n[0]) < 0.7 else (0.0, 1.0, 0.0))
    m = math.sqrt(c[0] * c[0] + c[1] * c[1] + c[2] * c[2])
    e1 = (c[0] / m, c[1] / m, c[2] / m)
    return e1, cross(n, e1), n


def lattice(v):
    if not v > -(1 << 20):
        return -(1 << 20)
    if v > 1 << 20:
        return 1 << 20
    return int(f32(f32(v + 2097152.0) + 0.5)) - 2097152


class Mesh:
    def __init__(self):
        self.positions, self.triangles = [], []


def add_vertices(patch, z, mesh, level):
    s = patch.spacing
    e1, e2, normal = frame(patch.u, patch.v)
    a = [f32(f32(c) * s) for c in e1]
    b = [f32(f32(c) * s) for c in e2]
    n = [f32(c) for c in normal]
    o = [f32(c * f32(float(patch.z0) * s)) for c in n]
    patch.vertex, patch.h = {}, {}
    mask = patch.mask['low', level]
    for y in range(mask.height):
        fy = float(patch.y0 + (y << level))
        for x in range(mask.width):
            if not mask(x, y):
                continue
            fx = float(patch.x0 + (x << level))
            patch.vertex[x, y] = len(mesh.positions)
            patch.h[x, y] = lattice(z[y][x])
            mesh.positions.append([
                lattice(f32(f32(f32(o[i] + f32(fy * b[i])) + f32(fx * a[i])) + f32(z[y][x] * n[i]))) for i in range(3)])


# --- 11 Meshing a patch ---

class Node:
    pass


def mesh_patch(patch, mesh, nodes, most_nodes, level):
    mask, vertex, h = patch.mask['low', level], patch.vertex, patch.h
    cells = [(x, y) for y in range(mask.height - 1) for x in range(mask.width - 1)
             if mask(x, y) + mask(x + 1, y) + mask(x, y + 1) + mask(x + 1, y + 1) >= 3]
    covered = set(cells)
    for x, y in vertex:
        if not {(x, y), (x - 1, y), (x, y - 1), (x - 1, y - 1)} & covered:
            raise Error(CORRUPT)
    for x, y in cells:
        a, b, c, d = (vertex.get(p) for p in ((x, y), (x + 1, y), (x, y + 1), (x + 1, y + 1)))
        if a is None:
            mesh.triangles.append((b, d, c))
        elif b is None:
            mesh.triangles.append((a, d, c))
        elif c is None:
            mesh.triangles.append((a, b, d))
        elif d is None:
            mesh.triangles.append((a, b, c))
        elif main_diagonal(h, x, y):
            mesh.triangles += [(a, b, d), (a, d, c)]
        else:
            mesh.triangles += [(a, b, c), (b, d, c)]
    piece = {}
    for cell in cells:
        if cell in piece:
            continue
        piece[cell] = cell
        reached = [cell]
        for x, y in reached:
            for other, p, p2 in (((x - 1, y), (x, y), (x, y + 1)), ((x + 1, y), (x + 1, y), (x + 1, y + 1)),
                                 ((x, y - 1), (x, y), (x + 1, y)), ((x, y + 1), (x, y + 1), (x + 1, y + 1))):
                if other in covered and other not in piece and p in vertex and p2 in vertex:
                    piece[other] = cell
                    reached.append(other)
    after, cell_of = {}, {}
    for x, y in cells:
        a, b, c, d = (x, y), (x + 1, y), (x, y + 1), (x + 1, y + 1)
        sides = [(p, q) for p, q, across in ((a, b, (x, y - 1)), (b, d, (x + 1, y)), (d, c, (x, y + 1)), (c, a, (x - 1, y)))
                 if p in vertex and q in vertex and across not in covered]
        for missing, side in ((a, (c, b)), (b, (a, d)), (c, (d, a)), (d, (b, c))):
            if missing not in vertex:
                sides.append(side)
        for p, q in sides:
            if p in after:
                raise Error(CORRUPT)
            after[p], cell_of[p] = q, (x, y)
    loop = nodes[-1].loop + 1 if nodes else 0
    for pixel in sorted(after, key=lambda p: (p[1], p[0])):
        first = len(nodes)
        while pixel in after:
            if len(nodes) == most_nodes:
                raise Error(CORRUPT)
            n = Node()
            n.vertex, n.patch, n.pixel, n.piece = vertex[pixel], patch, pixel, (id(patch), piece[cell_of[pixel]])
            n.position, n.spacing = tuple(mesh.positions[n.vertex]), int(patch.spacing * 2 ** level)
            n.normal = node_normal(pixel, covered, vertex, mesh.positions)
            n.number, n.loop, n.place = len(nodes), loop, len(nodes) - first
            n.prev, n.next = n.number - 1, n.number + 1
            nodes.append(n)
            pixel = after.pop(pixel)
        if len(nodes) > first:
            nodes[first].prev, nodes[-1].next = len(nodes) - 1, first
            loop += 1


def main_diagonal(h, x, y):
    corners = [(x - 1, y - 1), (x + 2, y - 1), (x - 1, y + 2), (x + 2, y + 2)]
    if not all(p in h for p in corners):
        return True
    main, anti = h[x, y] + h[x + 1, y + 1], h[x + 1, y] + h[x, y + 1]
    estimate = 9 * (main + anti) - sum(h[p] for p in corners)
    return not abs(16 * main - estimate) > abs(16 * anti - estimate)


QUARTERS = (((0, 0), ((1, 0), (1, 1), (0, 1))), ((-1, 0), ((0, 1), (-1, 1), (-1, 0))),
            ((-1, -1), ((-1, 0), (-1, -1), (0, -1))), ((0, -1), ((0, -1), (1, -1), (1, 0))))


def node_normal(pixel, covered, vertex, positions):
    x, y = pixel
    total = (0, 0, 0)
    for (cx, cy), ring in QUARTERS:
        if (x + cx, y + cy) not in covered:
            continue
        spokes = [minus(positions[vertex[x + dx, y + dy]], positions[vertex[pixel]])
                  for dx, dy in ring if (x + dx, y + dy) in vertex]
        for p, p2 in zip(spokes, spokes[1:]):
            total = tuple(s + c for s, c in zip(total, cross(p, p2)))
    return unit(total)


# --- 12 Closing the gaps ---

class Link:
    def __init__(self, a, b, rank, kind):
        self.a, self.b, self.rank, self.kind, self.inside = a, b, rank, kind, False

    def other(self, v):
        return self.b if v == self.a else self.a


class TubeEnd:  # 12.10
    def __init__(self, mesh, triangle):
        self.corners = mesh.triangles[triangle]
        self.p = p = [mesh.positions[v] for v in self.corners]
        self.middle = tuple(quotient(sum(q[k] for q in p), 3) for k in range(3))
        self.normal = unit(cross(minus(p[1], p[0]), minus(p[2], p[0])))

    def rim(self, to, way):
        square = lambda d: dot(d, d)
        d = minus(to, self.middle)
        length = root(square(d))
        height = min(root(min(square(minus(p, self.middle)) for p in self.p)) // 2, 3 * length // 8)
        for p in self.p:
            rise = height - (quotient(dot(minus(p, self.middle), d), 4 * length) if length else 0)
            yield [clamp(quotient(p[k] + 3 * self.middle[k], 4) + way * quotient(rise * self.normal[k], 4096), 1 << 20)
                   for k in range(3)]


class Gaps:
    def __init__(self, nodes, S, closed, seams, mesh):
        self.nodes, self.S, self.closed, self.seams, self.mesh = nodes, S, closed, seams, mesh
        self.at = 0
        self.outward()
        self.partners()
        self.make_links()
        self.sort_slots()
        self.put_links_in()
        patch_triangles = len(self.mesh.triangles)
        self.close_faces()
        if self.seams is not None:
            end = len(self.mesh.triangles)
            self.add_tubes(patch_triangles)
            self.add_steiner_points(patch_triangles, end)

    def square(self, a, b):
        d = minus(self.nodes[a].position, self.nodes[b].position)
        return dot(d, d)

    def dist(self, a, b):
        return root(self.square(a, b))

    def neighbouring(self, a, b):
        a, b = self.nodes[a], self.nodes[b]
        return a.patch is b.patch and abs(a.pixel[0] - b.pixel[0]) <= 1 and abs(a.pixel[1] - b.pixel[1]) <= 1

    def outward(self):  # 12.1
        self.loop_length = {}
        for v in self.nodes:
            self.loop_length[v.loop] = v.place + 1
            v.outward = unit(cross(minus(self.nodes[v.next].position, self.nodes[v.prev].position), v.normal))

    def partners(self):  # 12.2, 12.3
        nodes = self.nodes
        size = 6 * (sum(v.spacing for v in nodes) // len(nodes))
        self.g = next((g for g in range(20) if 1 << g >= size), 20)
        self.buckets = 1
        while self.buckets < len(nodes):
            self.buckets *= 2
        self.grid = {}
        for v in nodes:
            if v.place % 3 == 0:
                self.grid.setdefault(self.bucket(*(c >> self.g for c in v.position)), []).append(v.number)
        self.nearest, self.distance = {}, {}
        for v in nodes:
            self.partner(v.number, self.nearest[v.prev] if v.place > 0 else None)

    def bucket(self, X, Y, Z):
        return X + (Y * 19349663 ^ Z * 83492791) & self.buckets - 1

    def facing(self, v, u, d2):
        nv, nu = self.nodes[v], self.nodes[u]
        total = nv.spacing + nu.spacing
        reach = total * 7 // 4
        if d2 > reach * reach or self.neighbouring(v, u):
            return None
        if nv.loop == nu.loop:
            k = abs(nv.place - nu.place)
            if min(k, self.loop_length[nv.loop] - k) < 5:
                return None
        d = minus(nu.position, nv.position)
        length = root(d2) * 4096
        turned = dot(nv.normal, nu.normal) * 10 < -3 * 4096 * 4096
        slack = total * 4096 // 4 if turned else length * 3 // 20
        if dot(d, nv.outward) < -slack or dot(d, nu.outward) > slack:
            return None
        if turned:
            return 4 * d2
        if abs(dot(d, nv.normal)) * 10 > 9 * length and abs(dot(d, nu.normal)) * 10 > 9 * length:
            return 9 * d2
        return d2

    def worse(self, u, d2):
        return d2 > self.best or (d2 == self.best and self.found is not None and u >= self.found)

    def consider(self, v, u):
        d2 = self.square(v, u)
        if u == v or self.worse(u, d2):
            return
        d2 = self.facing(v, u, d2)
        if d2 is None or self.worse(u, d2):
            return
        self.best, self.found = d2, u

    def follow(self, v, start):
        nearest = start
        for way in ('prev', 'next'):
            u, vain = start, 0
            for _ in range(16):
                if vain == 2:
                    break
                u, vain = getattr(self.nodes[u], way), vain + 1
                if self.square(v, u) < self.square(v, nearest):
                    nearest, vain = u, 0
            if nearest != start:
                break
        self.consider(v, nearest)

    def cube(self, v, radius):
        low, high = ([c + s * radius >> self.g for c in self.nodes[v].position] for s in (-1, 1))
        for Z in range(low[2], high[2] + 1):
            for Y in range(low[1], high[1] + 1):
                X = low[0]
                while X <= high[0]:
                    first = self.bucket(X, Y, Z)
                    run = range(first, min(first + high[0] - X + 1, self.buckets))
                    found = [u for b in run for u in self.grid.get(b, ())]
                    self.visits += len(run) + len(found)
                    if self.visits > 4096:
                        return
                    for u in found:
                        self.consider(v, u)
                    X += len(run)

    def partner(self, v, near):
        spacing = self.nodes[v].spacing
        most = (spacing + self.S) * 7 // 4 + 1
        self.best, self.found, self.visits = most * most, None, 0
        if near is not None:
            self.follow(v, near)
        if self.found is None or (16 * self.best > 9 * (spacing + self.nodes[self.found].spacing) ** 2
                                  and self.nodes[v].place % 3 == 0):
            followed = self.found
            radius = 2 * spacing + 1 if followed is None else root(self.best) + 1
            while True:
                radius = min(radius, most)
                if followed is None:
                    self.best = radius * radius
                self.cube(v, radius)
                if self.found is not None or radius == most or self.visits > 4096:
                    break
                radius *= 2
            if self.found != followed:
                self.follow(v, self.found)
        self.nearest[v], self.distance[v] = self.found, root(self.best)

    def add_link(self, a, b, length, kind):  # 12.4
        if len(self.links) == 2 * len(self.nodes) or max(len(self.slots[a]), len(self.slots[b])) == 16:
            return
        link = Link(a, b, min(255, length >> max(0, self.S.bit_length() - 4)), kind)
        self.links.append(link)
        self.slots[a].append(link)
        self.slots[b].append(link)

    def make_links(self):
        self.links, self.slots = [], [[] for _ in self.nodes]
        for v in range(len(self.nodes)):
            u = self.nearest[v]
            if u is not None and not (self.nearest[u] == v and u < v):
                self.add_link(v, u, self.distance[v], 'plain')
        if self.seams is None:
            return
        for kind in 'dropped', 'handle':  # 12.5
            for number in self.numbers():
                if number >= len(self.links):
                    raise Error(CORRUPT)
                self.links[number].kind = kind
        for a in self.numbers():
            ahead = self.varint()
            if ahead == 0 or a + ahead >= len(self.nodes):
                raise Error(CORRUPT)
            b = a + ahead
            if not self.neighbouring(a, b) and self.nearest[a] != b and self.nearest[b] != a:
                self.add_link(a, b, self.dist(a, b), 'handle')

    def varint(self):
        if self.at == len(self.seams):
            return 0
        value, self.at, good = varint(self.seams, self.at)
        if not good:
            raise Error(CORRUPT)
        return value

    def numbers(self):
        number = -1
        while True:
            d = self.varint()
            if d == 0:
                return
            number += d
            if number > (1 << 32) - 2:
                raise Error(CORRUPT)
            yield number

    def sort_slots(self):  # 12.6
        for v, slots in enumerate(self.slots):
            angles = {id(link): self.angle(v, link.other(v)) for link in slots}
            ordered = []
            for link in reversed(slots):
                j = len(ordered)
                while j > 0 and self.before(link.other(v), angles[id(link)], ordered[j - 1].other(v),
                                            angles[id(ordered[j - 1])]):
                    j -= 1
                ordered.insert(j, link)
            self.slots[v] = ordered

    def angle(self, v, x):
        n = self.nodes[v]
        d = minus(self.nodes[x].position, n.position)
        inward = tuple(-c for c in n.outward)
        c, s = dot(inward, d) * 4096, dot(cross(inward, d), n.normal)
        while abs(c) >= 1 << 30 or abs(s) >= 1 << 30:
            c, s = quotient(c, 2), quotient(s, 2)
        return c, s

    def ahead(self, p, q):
        p, q = self.nodes[p], self.nodes[q]
        if p.loop != q.loop:
            return False
        length = self.loop_length[p.loop]
        k = (q.place - p.place) % length
        return k <= 16 and k < length // 2

    def before(self, x, angle_x, y, angle_y):
        if self.ahead(y, x):
            return True
        if self.ahead(x, y):
            return False
        (c, s), (c2, s2) = angle_x, angle_y
        h, h2 = s < 0 or (s == 0 and c < 0), s2 < 0 or (s2 == 0 and c2 < 0)
        return not h if h != h2 else c * s2 - s * c2 > 0

    # A corner is a node and a link, or None for the border.
    def last_before(self, v, i):
        return next((link for link in reversed(self.slots[v][:i]) if link.inside), None)

    def after(self, corner):
        v, link = corner
        if link is None:
            u = self.nodes[v].prev
            return u, self.last_before(u, len(self.slots[u]))
        u = link.other(v)
        return u, self.last_before(u, self.slots[u].index(link))

    def rim(self, corner):
        corners = [corner]
        while True:
            c = self.after(corners[-1])
            if c == corner:
                return corners
            corners.append(c)

    def put_links_in(self):  # 12.7
        order = sorted(range(len(self.links)), key=lambda i: (self.links[i].rank, i))
        self.steps = 320 * len(self.nodes)
        parent = {}

        def find(piece):
            while piece in parent:
                piece = parent[piece]
            return piece

        for kind in 'plain', 'handle', 'refused':
            for i in order:
                if self.steps <= 0:
                    return
                link = self.links[i]
                if link.kind != kind:
                    continue
                a, b = max(link.a, link.b), min(link.a, link.b)
                A = (a, self.last_before(a, self.slots[a].index(link)))
                B = (b, self.last_before(b, self.slots[b].index(link)))
                rim = self.rim(A)
                piece_a, piece_b = find(self.nodes[a].piece), find(self.nodes[b].piece)
                if B in rim:
                    link.inside = True
                    x, y = len(self.rim((a, link))), len(self.rim((b, link)))
                elif piece_a == piece_b and link.kind != 'handle' and not (
                        self.seams is None and kind == 'refused' and len(rim) > 12 and len(self.rim(B)) > 12):
                    link.kind = 'refused'
                    continue
                else:
                    x, y = len(rim), len(self.rim(B))
                    link.inside = True
                    if piece_a != piece_b:
                        parent[piece_a] = piece_b
                link.kind = 'in'
                self.steps -= 2 * min(x, y)

    def close_faces(self):  # 12.8
        self.diagonals = set()
        self.left_open = set()
        self.taken = set()
        holes = self.numbers() if self.seams is not None else iter(())
        self.hole = next(holes, None)
        self.faces = 0
        starts = [(v, None) for v in range(len(self.nodes))]
        starts += [(v, link) for v, slots in enumerate(self.slots) for link in slots if link.inside]
        for start in starts:
            if start in self.taken:
                continue
            corners = self.rim(start)
            self.taken.update(corners)
            q = [v for v, _ in corners]
            is_open = not self.closed and self.seams is None and len(q) > 12
            if not self.closed and self.hole == self.faces and self.hole is not None:
                is_open = True
                self.hole = next_or_last(holes, self)
            self.faces += 1
            if is_open:
                self.leave_open(q)
            else:
                self.close(q)
        if self.late_error:
            raise Error(CORRUPT)
        for _ in holes:
            pass

    def add_tubes(self, patch_triangles):  # 12.10
        mesh, left = self.mesh, len(self.nodes) // 32
        joined = set()
        for x in self.numbers():
            ahead = self.varint()
            y = x + ahead
            if ahead == 0 or y >= patch_triangles or left == 0 or x in joined or y in joined:
                raise Error(CORRUPT)
            left -= 1
            joined.update((x, y))
            ends = [TubeEnd(mesh, t) for t in (x, y)]
            d = minus(ends[1].middle, ends[0].middle)
            way = 1 if dot(d, minus(ends[0].normal, ends[1].normal)) >= 0 else -1
            rims = [list(end.rim(other.middle, way)) for end, other in zip(ends, reversed(ends))]
            square = lambda d: dot(d, d)
            turn = min(range(3), key=lambda turn: sum(square(minus(rims[0][i], rims[1][turn - i])) for i in range(3)))
            a, b = ends[0].corners, [ends[1].corners[turn - i] for i in range(3)]
            u = [self.add_vertex(p) for p in rims[0]]
            v = [self.add_vertex(rims[1][turn - i]) for i in range(3)]
            tube = []
            for i in range(3):
                j = (i + 1) % 3
                tube += [(a[i], a[j], u[j]), (b[j], b[i], v[i]), (a[i], u[j], u[i]), (b[j], v[i], v[j]),
                         (u[i], u[j], v[j]), (u[i], v[j], v[i])]
            mesh.triangles[x], mesh.triangles[y] = tube[:2]
            mesh.triangles += tube[2:]

    def add_steiner_points(self, first, end):  # 12.11
        triangles, positions, left = self.mesh.triangles, self.mesh.positions, len(self.nodes) // 8
        turned = lambda t, k: triangles[t][k:] + triangles[t][:k]
        for t in self.numbers():
            t += first
            z, k = divmod(self.varint(), 3)
            if t >= end or z >= 256 or left == 0:
                raise Error(CORRUPT)
            left -= 1
            height = -(z + 1) // 2 if z % 2 else z // 2
            a, b, c = turned(t, k)
            u, l = next(((u, l) for u in range(t + 1, min(end, t + 257)) for l in range(3) if turned(u, l)[:2] == (b, a)),
                        (None, 0))
            if u is None:
                continue
            d = turned(u, l)[2]
            along = minus(positions[b], positions[a])
            normal = unit(cross(along, minus(positions[c], positions[d])))
            length = root(dot(along, along))
            v = self.add_vertex([clamp(quotient(positions[a][i] + positions[b][i], 2)
                                       + quotient(height * length * normal[i], 8 * 4096), 1 << 20) for i in range(3)])
            triangles[t] = tuple(v if w == b else w for w in triangles[t])
            triangles[u] = tuple(v if w == a else w for w in triangles[u])
            triangles += [(v, b, c), (v, a, d)]

    late_error = False

    def edge(self, a, b):
        return (self.nodes[a].next == b or self.nodes[a].prev == b or self.neighbouring(a, b)
                or any(link.inside and link.other(a) == b for link in self.slots[a]) or frozenset((a, b)) in self.diagonals)

    def normal(self, a, b, c):
        position = lambda i: self.nodes[i].position
        return tuple(unit(cross(minus(position(c), position(b)), minus(position(a), position(b)))))

    def beyond(self, a, b):
        if self.nodes[a].prev != b:
            return (0, 0, 0)
        return tuple(quotient(x + y, 2) for x, y in zip(self.nodes[a].normal, self.nodes[b].normal))

    def folding(self, u, v):
        d = quotient(dot(u, v), 4096)
        return -100 * self.S * d if d < -3584 else 0

    def alignment(self, a, b, c):
        w = self.normal(a, b, c)
        if w == (0, 0, 0):
            return -4096
        return quotient(sum(dot(w, self.nodes[i].normal) for i in (a, b, c)), 3 * 4096)

    def weigh(self, length, a, b, c):
        aligned = self.alignment(a, b, c)
        cost = length * (4096 + 4 * (4096 - aligned))
        spacing = max(self.nodes[i].spacing for i in (a, b, c))
        return cost + 10 * spacing * (4096 - aligned) if aligned < 0 else cost

    def triangle(self, a, b, c):
        self.mesh.triangles.append(tuple(self.nodes[i].vertex for i in (a, b, c)))

    def add_vertex(self, p):
        self.mesh.positions.append(list(p))
        return len(self.mesh.positions) - 1

    def leave_open(self, q):  # 12.9
        moved = [q.count(node) > 1 or node in self.left_open for node in q]
        self.ring(q, moved)
        self.left_open |= {node for node, m in zip(q, moved) if not m}

    def close(self, q):
        if len(q) < 3:
            return
        if len(q) == 3 and len(set(q)) == 3:
            self.triangle(*q)
            return
        if 12 < len(q) <= 256:
            self.ears(q)
        if len(q) <= 12 and self.best_triangulation(q):
            return
        middle = [quotient(sum(self.nodes[i].position[k] for i in q), len(q)) for k in range(3)]
        self.ring(q, [q.count(node) > 1 for node in q], middle)

    def ears(self, q):
        def cost_at(i):
            a, b, c = q[i - 1], q[i], q[(i + 1) % len(q)]
            if a == c or self.edge(a, c):
                return math.inf
            return self.weigh(self.dist(a, c), a, b, c)
        cost = [cost_at(i) for i in range(len(q))]
        while len(q) > 12:
            best = cost.index(min(cost))
            if cost[best] == math.inf:
                return
            a, b, c = q[best - 1], q[best], q[(best + 1) % len(q)]
            if self.edge(a, c):
                cost[best] = math.inf
                continue
            self.triangle(a, b, c)
            self.diagonals.add(frozenset((a, c)))
            del q[best], cost[best]
            for i in (best, best - 1):
                cost[i % len(q)] = cost_at(i % len(q))

    def best_triangulation(self, q):
        m = len(q)
        best, at, n = {}, {}, {}
        for i in range(m - 1):
            best[i, i + 1], n[i, i + 1] = 0, self.beyond(q[i], q[i + 1])
        for span in range(2, m):
            for i in range(m - span):
                j = i + span
                whole = span == m - 1
                self.best_part(q, i, j, self.beyond(q[m - 1], q[0]) if whole else (0, 0, 0), best, at, n)
                if not whole and self.edge(q[i], q[j]):
                    best[i, j] += 8 * self.S * 4096
        if best[0, m - 1] == math.inf:
            return False
        queue = [(0, m - 1, None)]
        for i, j, middle in queue:
            k = at[i, j]
            first = self.side(q, i, k, j, at, queue)
            second = self.side(q, k, j, i, at, queue)
            self.split_triangle((q[i], q[k], q[j]), (first, second, middle))
        return True

    def best_part(self, q, i, j, beyond, best, at, n):
        best[i, j] = math.inf
        for k in range(i + 1, j):
            a, b, c = q[i], q[k], q[j]
            both = best[i, k] + best[k, j]
            if both == math.inf or len({a, b, c}) < 3:
                continue
            if (k - i > 1 and q[at[i, k]] == c) or (j - k > 1 and q[at[k, j]] == a):
                continue
            u = self.normal(a, b, c)
            cost = both + self.weigh(self.dist(a, b) + self.dist(b, c) + self.dist(c, a), a, b, c)
            cost += self.folding(u, n[i, k]) + self.folding(u, n[k, j]) + self.folding(u, beyond)
            if cost < best[i, j]:
                best[i, j], at[i, j], n[i, j] = cost, k, u

    def side(self, q, i, j, behind, at, queue):
        """Makes the diagonal from corner i to j; the vertex that splits it, or None."""
        if j - i == 1:
            return None
        middle = None
        if self.edge(q[i], q[j]):
            towards = q[behind] if q[i] < q[j] else q[at[i, j]]
            p, r, z = (self.nodes[v].position for v in (q[i], q[j], towards))
            middle = self.add_vertex([quotient(15 * (p[k] + r[k]) + 2 * z[k], 32) for k in range(3)])
        else:
            self.diagonals.add(frozenset((q[i], q[j])))
        queue.append((i, j, middle))
        return middle

    def split_triangle(self, corners, middles):
        v, first = [], 0
        for node, middle in zip(corners, middles):
            v.append(self.nodes[node].vertex)
            if middle is not None:
                first = first or len(v)
                v.append(middle)
        v = v[first:] + v[:first]
        self.mesh.triangles += [(v[0], v[i], v[i + 1]) for i in range(1, len(v) - 1)]

    def ring(self, q, moved, middle=None):
        m, r = len(q), []
        for i in range(m):
            node, before, after = (self.nodes[k] for k in (q[i], q[i - 1], q[(i + 1) % m]))
            if not moved[i]:
                r.append(node.vertex)
                continue
            d = [before.position[k] + after.position[k] - 2 * node.position[k] for k in range(3)]
            reach, length = node.spacing // 4, root(dot(d, d)) + 1
            r.append(self.add_vertex(node.position[k] + (quotient(d[k] * reach, length) if length > reach else d[k])
                                     for k in range(3)))
        centre = None if middle is None else self.add_vertex(middle)
        for i in range(m):
            j = (i + 1) % m
            u, v = self.nodes[q[i]].vertex, self.nodes[q[j]].vertex
            if moved[i]:
                self.mesh.triangles.append((u, v, r[i]))
            if moved[j]:
                self.mesh.triangles.append((v, r[j], r[i]))
            if centre is not None:
                self.mesh.triangles.append((r[i], r[j], centre))


def next_or_last(holes, gaps):
    """The next number; a malformed one is an error only after all faces, as there may be no room for these."""
    try:
        return next(holes, None)
    except Error:
        gaps.late_error = True
        return None


# --- 13 Output ---

def smooth(mesh, nodes):
    others = {n.vertex: [] for n in nodes}
    for t in mesh.triangles:
        for k, v in enumerate(t):
            if v in others:
                others[v] += [t[k - 1], t[k - 2]]
    moved = {}
    for v, around in others.items():
        if around:
            mean = [quotient(sum(mesh.positions[u][i] for u in around), len(around)) for i in range(3)]
            moved[v] = [p + quotient(m - p, 3) for p, m in zip(mesh.positions[v], mean)]
    for v, p in moved.items():
        mesh.positions[v] = p


def read_colours(stream, patches, level):
    """Of each patch three images."""
    for p in patches:
        p.colour = []
    for channel, (data, cut) in enumerate(stream.colours):
        for p in patches:
            p.q = {key: Plane(w, h) for key, (w, h) in sizes(p.width, p.height).items()}
        read_subband(Coder(data, cut), patches)
        step = f32(f32(float(stream.colour_step)) * (1 / 128 if channel else 1 / 256))
        for p in patches:
            image = inverse(p, step, level)
            p.colour.append([[max(-255, min(255, lattice(v))) for v in row] for row in image])


def patch_colours(patch, mask):
    """Of the pixels of the mask, in order."""
    byte = lambda v: max(0, min(255, v))
    for y, row in enumerate(mask.rows):
        for x, inside in enumerate(row):
            if inside:
                luma, orange, green = (image[y][x] for image in patch.colour)
                t = luma + 128 - (green >> 1)
                blue = t - (orange >> 1)
                yield [byte(blue + orange), byte(green + t), byte(blue), 255]


def gap_colours(colours, mesh, first_triangle):
    colours += [[128, 128, 128, 0] for _ in range(len(mesh.positions) - len(colours))]
    for _ in range(3):
        for t in mesh.triangles[first_triangle:]:
            for k in range(3):
                if colours[t[k]][3] == 0:
                    colours[t[k]] = colours[t[(k + 1) % 3]][:]
    for c in colours:
        c[3] = 255


def output(stream, mesh, points, colours):
    P = [[float(c) for c in p] for p in mesh.positions]
    normals = [[0.0, 0.0, 0.0] for _ in P]
    for t in mesh.triangles:
        u = [f32(P[t[1]][i] - P[t[0]][i]) for i in range(3)]
        v = [f32(P[t[2]][i] - P[t[0]][i]) for i in range(3)]
        for k, (i, j) in enumerate(((1, 2), (2, 0), (0, 1))):
            n = f32(f32(u[i] * v[j]) - f32(u[j] * v[i]))
            for corner in t:
                normals[corner][k] = f32(normals[corner][k] + n)
    for n in normals:
        s = f32(f32(f32(n[0] * n[0]) + f32(n[1] * n[1])) + f32(n[2] * n[2]))
        if s > 0:
            l = f32(math.sqrt(s))
            n[:] = [f32(c / l) for c in n]
        else:
            n[2] = 1.0
    placed = [f32(o + stream.scale * c) for p in P for o, c in zip(stream.origin, p)]
    flat = [c for n in normals for c in n]
    indices = [] if points else [i for t in mesh.triangles for i in t]
    return (struct.pack('<%df' % len(placed), *placed) + struct.pack('<%df' % len(flat), *flat)
            + struct.pack('<%dI' % len(indices), *indices) + bytes(c for colour in colours for c in colour))


LIMITS = (1 << 20, 1 << 28, 1 << 27)


def decode(data, limits=LIMITS, smoothed=False, points=False, level=0, wanted='1'):
    stream = Stream(data, limits)
    coder = Coder(stream.table, stream.masks_cut)
    patches = read_table(stream, coder, limits)
    most_vertices = stream.mask_pixels + 7 * stream.boundary_nodes
    most_triangles = 2 * stream.mask_pixels + 15 * stream.boundary_nodes + 16 * (stream.boundary_nodes // 32)
    if max(most_vertices, most_triangles) > 0xffffffff:
        raise Error(LIMIT)
    if stream.memory > (1 << 30) + (len(data) << 16):
        raise Error(TRUNCATED if stream.masks_cut else LIMIT)
    if stream.vertex_count > most_vertices or stream.triangle_count > most_triangles:
        raise Error(CORRUPT)
    mask_models = MaskModels()
    for p in patches:
        rows = None if coder.exhausted() else read_mask(coder, mask_models, p.width, p.height)
        p.here = not coder.exhausted()
        p.mask = {('low', 0): Plane(p.width, p.height, rows if p.here else [[0] * p.width for _ in range(p.height)])}
        make_masks(p)
    pixels = sum(sum(map(sum, p.mask['low', 0].rows)) for p in patches)
    if pixels > stream.mask_pixels or (pixels < stream.mask_pixels and not stream.masks_cut):
        raise Error(CORRUPT)
    read_coefficients(stream, patches)
    z_of = {p: heights(p, level) for p in patches}
    if stream.flags & 4:
        read_colours(stream, patches, level)
    colours = []
    mesh, nodes = Mesh(), []
    chosen = [p for i, p in enumerate(patches) if p.here and wanted[i % len(wanted)] == '1']
    whole = len(chosen) == len(patches) and not stream.masks_cut
    for p in chosen:
        z = z_of[p]
        if level > 0:
            tidy(p.mask['low', level])
        before = len(mesh.positions), len(mesh.triangles), len(nodes)
        add_vertices(p, z, mesh, level)
        try:
            mesh_patch(p, mesh, nodes, stream.boundary_nodes, level)
        except Error:
            if level == 0:
                raise
            for all, count in zip((mesh.positions, mesh.triangles, nodes), before):
                del all[count:]
            continue
        if stream.flags & 4:
            colours += patch_colours(p, p.mask['low', level])
    if whole and level == 0 and len(nodes) != stream.boundary_nodes:
        raise Error(CORRUPT)
    patch_triangles = len(mesh.triangles)
    if nodes and not points:
        Gaps(nodes, int(max(p.spacing for p in patches) * 2 ** level), whole and bool(stream.flags & 1),
             stream.seams if whole and level == 0 else None, mesh)
    if smoothed:
        smooth(mesh, nodes)
    if stream.flags & 4:
        gap_colours(colours, mesh, patch_triangles)
    return output(stream, mesh, points, colours)


def main(arguments):
    options = {}
    while arguments and arguments[0].startswith('--'):
        option = arguments.pop(0)
        if option == '--smooth':
            options['smoothed'] = True
        elif option == '--points':
            options['points'] = True
        elif option == '--level':
            options['level'] = int(arguments.pop(0))
        elif option == '--patches':
            options['wanted'] = arguments.pop(0)
        elif option == '--limits':
            options['limits'] = tuple(int(arguments.pop(0)) for _ in range(3))
        else:
            sys.exit(__doc__)
    for name in arguments:
        with open(name, 'rb') as file:
            data = file.read()
        try:
            print(hashlib.sha256(decode(data, **options)).hexdigest())
        except Error as e:
            print(e.args[0])


if __name__ == '__main__':
    main(sys.argv[1:])
